"""A network on snnTorch; its weights are a sparse matrix if most of them are zero."""

import warnings

import numpy as np
import snntorch
import torch
from traffic import Running, Traffic, contest


def build(traffic: Traffic) -> Running:
    """Build the network."""
    torch.set_num_threads(1)
    torch.set_grad_enabled(False)
    shape = (traffic.n, traffic.n)
    at = np.stack((traffic.target, traffic.source))
    weights = torch.sparse_coo_tensor(at, traffic.weight.astype(np.float32), shape).coalesce()
    warnings.simplefilter("ignore")  # the warning that sparse rows are in beta
    weights = weights.to_dense() if traffic.is_dense else weights.to_sparse_csr()
    bias, vth = (torch.tensor(array, dtype=torch.float32) for array in (traffic.bias, traffic.vth))
    neurons = snntorch.Leaky(beta=1.0, threshold=vth, reset_mechanism="zero", reset_delay=False)
    state = {"v": neurons.init_leaky(), "spikes": torch.zeros(traffic.n)}
    count = torch.zeros(traffic.n)

    def run(steps: int) -> None:
        for _ in range(steps):
            arriving = torch.mv(weights, state["spikes"])
            state["spikes"], state["v"] = neurons(arriving + bias, state["v"])
            count.add_(state["spikes"])

    return Running(run, lambda: count.numpy().astype(int))


contest(f"snnTorch {snntorch.__version__}, PyTorch {torch.__version__}", build)
