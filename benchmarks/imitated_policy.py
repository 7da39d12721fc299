"""A policy that imitates the shipped one, and whose hidden units never had noise.

    OPENBLAS_NUM_THREADS=1 python benchmarks/imitated_policy.py --out build/imitated.npz

The shipped policy was trained with noise on its hidden units that stands for spikes. Here a new
network of the same size learns its actions from observations alone, by least squares:

    min_W  mean |pi_W(o) - pi_shipped(o)|^2

over observations of robots that first the shipped policy and then the new one walks (DAgger,
Ross, Gordon and Bagnell 2011). So both walk alike, and differ in their hidden units: if the new
one needs more neurons than the shipped one, the lack of noise in training is the cause.
"""

import argparse
from dataclasses import asdict
from pathlib import Path

import numpy as np
import torch

from spikeport.networks.walking_policy import WalkingPolicy, load
from spikeport.robot.mirror import JOINT, OBSERVATION
from spikeport.training.curriculum import STAGES
from spikeport.training.environment import WalkEnvironment
from spikeport.training.evaluate import BatchPolicy, evaluate
from spikeport.training.export import policy_of
from spikeport.training.learner import observation_scale
from spikeport.training.networks import SYMMETRY_BREAKING_SD, MirrorNetwork

ROBOTS, STEPS, ROUNDS = 512, 48, 8
"""Robots, control steps of a round, and rounds."""
EPOCHS, LAST_EPOCHS, BATCH = 6, 40, 1024
"""Epochs after each round and after the last, and observations of a step of the optimiser."""
LEARNING_RATE = 2e-3
EPISODES, EVALUATION_SEED = 100, 30_000


def imitate(shipped: WalkingPolicy, seed: int) -> WalkingPolicy:
    """Return a policy that has learned the actions of another one."""
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    network = MirrorNetwork(OBSERVATION, JOINT, observation_scale(), 1.0, SYMMETRY_BREAKING_SD)
    network.use([bool(row.any()) for row in shipped.weights[-1]])
    env = WalkEnvironment(ROBOTS, STAGES[-1].task, seed, threads=1)
    env.spread_ages()
    observed: list[np.ndarray] = []
    acting: BatchPolicy = shipped
    try:
        for i in range(ROUNDS):
            observed.append(_walk(env, acting))
            error = _fit(network, shipped, np.concatenate(observed), EPOCHS)
            print(f"round {i + 1} of {ROUNDS}: rms error {error:.4f}", flush=True)
            acting = policy_of(network)
    finally:
        env.close()
    print(f"at last {_fit(network, shipped, np.concatenate(observed), LAST_EPOCHS):.4f}")
    return policy_of(network)


def _walk(env: WalkEnvironment, policy: BatchPolicy) -> np.ndarray:
    """Return the observations of a round."""
    observed = []
    for _ in range(STEPS):
        observed.append(env.observe())
        env.step(policy(observed[-1]))
    return np.concatenate(observed)


def _fit(network: MirrorNetwork, shipped: WalkingPolicy, seen: np.ndarray, epochs: int) -> float:
    """Fit the network to the shipped policy's actions; returns the rms error of the last epoch."""
    inputs, targets = (torch.as_tensor(x, dtype=torch.float) for x in (seen, shipped(seen)))
    optimiser = torch.optim.Adam(network.parameters(), LEARNING_RATE)
    steps = epochs * -(-len(inputs) // BATCH)
    decay = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
    error = 0.0
    for _ in range(epochs):
        error = 0.0
        for batch in torch.randperm(len(inputs)).split(BATCH):
            loss = (network(inputs[batch]) - targets[batch]).square().mean()
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            decay.step()
            error += loss.item() * len(batch) / len(inputs)
    return float(np.sqrt(error))


def main() -> None:
    """Make the policy, write it, and print how it and the shipped one walk."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    shipped = load()
    made = imitate(shipped, asked.seed)
    made.save(asked.out)
    for name, policy in {"shipped": shipped, "imitated": made}.items():
        found = evaluate(policy, STAGES[-1].task, episodes=EPISODES, seed=EVALUATION_SEED)
        print(name, asdict(found))


if __name__ == "__main__":
    main()
