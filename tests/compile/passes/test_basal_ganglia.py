"""nengo_spa's basal ganglia and thalamus, compiled with and without passes."""

import nengo
import nengo_spa
import numpy as np
import pytest

from spikeport.backends.host_loop import HostLoop
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.pipeline import Compilation, compile_network

PASSES = "fuse,decode_path,scale_rows,merge_axons,split,pack"
N_ACTIONS = 3
PERIOD_STEPS = 300
SETTLED = 100
"""Steps after a change from which the selection is scored."""


def best(t: float) -> int:
    """Return the action of the highest utility, which changes every 0.3 s."""
    return int((t - 5e-4) * 1000 / PERIOD_STEPS) % N_ACTIONS


def selection(seed: int) -> nengo.Network:
    with nengo_spa.Network(seed=seed, label="selection") as network:
        ganglia = nengo_spa.modules.BasalGanglia(N_ACTIONS, label="ganglia")
        thalamus = nengo_spa.modules.Thalamus(N_ACTIONS, label="thalamus")
        utilities = nengo.Node(lambda t: np.where(np.arange(N_ACTIONS) == best(t), 0.8, 0.4))
        nengo.Connection(utilities, ganglia.input, synapse=None)
        thalamus.connect_bg(ganglia)
        selected = nengo.Node(lambda _t, x: x, size_in=N_ACTIONS, label="selected")
        nengo.Connection(thalamus.actions.output, selected, synapse=0.01)
        network.probe = nengo.Probe(selected)
    return network


def compiled(seed: int, passes: str = PASSES) -> tuple[nengo.Network, Compilation]:
    network = selection(seed)
    return network, compile_network(network, pipeline=passes)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_the_best_action_is_selected_on_four_cores(seed: int) -> None:
    network, compilation = compiled(seed)
    assert len(compilation.report.cores) <= 4
    loop = HostLoop(compilation, NativeChip(compilation.image, seed=1), seed=1)
    for _ in range(N_ACTIONS * PERIOD_STEPS):
        loop.step()
    values = loop.data(network.probe).reshape(N_ACTIONS, PERIOD_STEPS, N_ACTIONS)
    means = values[:, SETTLED:].mean(axis=1)
    assert np.all(np.diag(means) > 0.9)
    assert np.all(means[~np.eye(N_ACTIONS, dtype=bool)] < 0.1)


@pytest.mark.slow
def test_the_network_takes_sixty_cores_without_passes() -> None:
    assert len(compiled(seed=1, passes="")[1].report.cores) == 60
