"""Policies that walk episodes: the exact one in its own loop, or a spiking one in a simulator."""

import dataclasses
from typing import Protocol

import nengo
import numpy as np

from spikeport.constants import DT_S
from spikeport.experiments.digests import digests
from spikeport.experiments.driver import simulator
from spikeport.experiments.evaluate.stage import Stage
from spikeport.experiments.options import Options
from spikeport.experiments.stepping import advance
from spikeport.experiments.sweep.keeper import Keeper
from spikeport.experiments.walk.legs import OBSERVATION_DT_S
from spikeport.experiments.walk.settings import WalkSettings
from spikeport.experiments.walk.trial import WalkTrial
from spikeport.hardware_models import chip as chips
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.node_functions import Skippable
from spikeport.robot.perturbation import Perturbation
from spikeport.robot.times import PHYSICS_DT_S
from spikeport.robot.walk_interface import ACTION_SIZE, CONTROL_DT_S, OBSERVATION_SIZE


class Walker(Protocol):
    """A policy that walks episodes."""

    def walk(self, perturbation: Perturbation, seconds: float, seed: int) -> Stage:
        """Walk an episode, up to a fall, and return its stage."""

    def close(self) -> None:
        """Free the walker's resources."""


class ExactWalker:
    """The exact policy, which observes and acts every 20 ms."""

    def __init__(self, policy: WalkingPolicy) -> None:
        self._policy = policy

    def walk(self, perturbation: Perturbation, seconds: float, seed: int) -> Stage:
        """Walk an episode; see `Walker.walk`."""
        stage = Stage(perturbation, seconds, seed, None, CONTROL_DT_S, PHYSICS_DT_S)
        every, action = round(CONTROL_DT_S / PHYSICS_DT_S), np.zeros(ACTION_SIZE)
        for step in range(stage.n_steps):
            if stage.over:
                break
            observed = stage.advance(action)
            if (step + 1) % every == 0:
                action = self._policy(observed)
        return stage

    def close(self) -> None:
        """Do nothing: an exact policy has no resources."""


class SpikingWalker:
    """A policy of neurons, compiled once; each episode puts a new robot into its loop.

    Parameters
    ----------
    trial : WalkTrial
        The settings and options of the policy.
    """

    def __init__(self, trial: WalkTrial) -> None:
        walker, self._encoding = trial.spiking_policy()
        self._on_stage = _OnStage()
        with nengo.Network(label="policy", seed=trial.settings.network_seed) as network:
            network.add(walker)
            robot = nengo.Node(self._on_stage, size_in=ACTION_SIZE, size_out=OBSERVATION_SIZE)
            nengo.Connection(robot, walker.observation, synapse=None)
            nengo.Connection(walker.action, robot, synapse=None)
        self._sim = simulator(network, trial.options)

    def walk(self, perturbation: Perturbation, seconds: float, seed: int) -> Stage:
        """Walk an episode; see `Walker.walk`."""
        stage = Stage(perturbation, seconds, seed, self._encoding, OBSERVATION_DT_S, DT_S)
        # The network's node steps this robot from here on.
        self._on_stage.stage = stage
        self._sim.reset(seed)
        for _ in range(stage.n_steps):
            if stage.over:
                break
            advance(self._sim)
        return stage

    def close(self) -> None:
        """End the simulation, and let go of it; see `SpikingHalves.close`."""
        self._sim.close()
        del self._sim


class _OnStage(Skippable):
    """The function of the robot's node: called in the robot's steps, held in between."""

    stage: Stage

    def __call__(self, _t: float, action: np.ndarray) -> np.ndarray:
        return self.stage.advance(action)

    def skip(self) -> int:
        return self.stage.skip()


def find_walker(settings: WalkSettings, options: Options) -> Walker:
    """Return the walker for settings and options, made once per process for all perturbations."""
    # The stage applies perturbations: the policy is the same network under all of them.
    unperturbed = dataclasses.replace(settings, **dataclasses.asdict(Perturbation()))
    # A worker of a cluster outlives an evaluation; the next one may change files of these names.
    contents = digests([*unperturbed.files, *chips.files_of(options.chip)]).values()
    alike = dataclasses.replace(options, seed=0, seconds=0.0)
    key = unperturbed, alike, tuple(contents)
    return WALKERS.get(key, lambda: _made(unperturbed, alike))


WALKERS: Keeper[Walker] = Keeper()
"""Keeps the walker of the last episode for episodes with the same policy."""


def _made(settings: WalkSettings, options: Options) -> Walker:
    trial = WalkTrial(settings, options)
    if trial.exact_policy:
        return ExactWalker(settings.walking_policy())
    return SpikingWalker(trial)
