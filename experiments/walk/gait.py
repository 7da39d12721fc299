"""Gaits for which a spiking policy is made and calibrated.

The exact policy walks random commands for 40 s, undisturbed, or under each of some perturbations
(`spikeport.experiments.policy.settings.GAITS`). Its observations, with their mirror images, give
the range of every observation (`encoding`), and of every hidden unit
(`spikeport.networks.policy.record_ranges`), and a read-out is refitted on them. A spiking policy
knows nothing else: to recover from pushes it needs a gait with pushes. The drift of a policy that
walks straight on gives its trim (`drift_trim`).
"""

import functools
from collections.abc import Callable, Sequence

import numpy as np

from spikeport.experiments.loop import Loop
from spikeport.experiments.policy.calibration import Policy, Walks
from spikeport.experiments.walk.legs import OBSERVATION_DT_S, LegsPort
from spikeport.networks.region import Box
from spikeport.robot import mirror
from spikeport.robot.perturbation import NONE, Perturbation
from spikeport.robot.perturbed_plant import PerturbedPlant
from spikeport.robot.plant import Plant
from spikeport.robot.walk_interface import ACTION_SIZE, OBSERVATION_SIZE, PARTS

SECONDS = 40.0
SEED = 1000
"""The seed of gaits, which `spikeport evaluate` refuses; robots that fell start with larger."""
HELD_S = 2.5
"""The time for which a command is held."""
TAIL = 0.001
"""Share of the samples beyond the range of an observation, on each side."""
MARGIN = 0.2
"""The share by which the range is wider than the recorded one: robots sway more on spikes."""
NARROWEST = 0.02
"""Half the range of an observation that never changes."""
STRAIGHT = (0.5, 0.0)
"""Forward speed in m/s and yaw rate in rad/s of a walk that shows how a policy drifts."""
STRAIGHT_S = 20.0
SETTLED = 400
"""The number of observations after which the gait of a robot is settled."""
SIDEWAYS = PARTS["linear velocity"].start + 1
COMMANDS = ((0.0, 1.0), (-1.0, 1.0))
"""Forward speed in m/s and yaw rate in rad/s for which the policy is trained."""


def record_gait(
    policy: Policy, perturbations: Sequence[Perturbation] = (NONE,), seconds: float = SECONDS
) -> np.ndarray:
    """Record observations (n, 69) and their mirror images; a robot that falls is stood up again.

    A read-out that is refitted on both treats left and right as the policy does. The robot walks
    for ``seconds`` under each of the perturbations.
    """
    rng = np.random.RandomState(SEED)

    def command() -> list[float]:
        return [rng.uniform(*reach) for reach in COMMANDS]

    plants = [Plant() if one == NONE else PerturbedPlant(one) for one in perturbations]
    observed = np.concatenate([_walked(policy, plant, command, seconds) for plant in plants])
    return np.concatenate((observed, mirror.OBSERVATION(observed)))


def drift_trim(policy: Policy) -> np.ndarray:
    """Return the offset of observations (69,) that keeps a robot straight, without drift.

    A policy that observes a sideways motion moves as much the other way: the trim is the mean
    sideways velocity.
    """
    trim = np.zeros(OBSERVATION_SIZE)
    observed = _walked(policy, Plant(), lambda: STRAIGHT, STRAIGHT_S)
    trim[SIDEWAYS] = observed[SETTLED:, SIDEWAYS].mean()
    return trim


def walks(perturbations: Sequence[Perturbation]) -> Walks:
    """Return the walks that calibrate a policy: perturbed, and straight on without perturbation."""
    return Walks(functools.partial(record_gait, perturbations=perturbations), drift_trim)


def _walked(
    policy: Policy, plant: Plant, command: Callable[[], Sequence[float]], seconds: float
) -> np.ndarray:
    """Return observations (n, 69) of a robot that gets a new command every 2.5 s."""
    legs = LegsPort(plant, None, OBSERVATION_DT_S)
    loop = Loop(plant, [legs], OBSERVATION_DT_S)
    plant.reset(SEED)
    loop.begin()
    action, observed = np.zeros(ACTION_SIZE), []
    for step in range(round(seconds / OBSERVATION_DT_S)):
        if step % round(HELD_S / OBSERVATION_DT_S) == 0:
            wanted = command()
        observed.append(loop.step(np.concatenate((action, wanted))))
        action = policy(observed[-1])
        if loop.over:
            # Another seed each time: from the same start it might fall the same way for ever.
            plant.reset(SEED + step)
            loop.begin()
            action = np.zeros(ACTION_SIZE)
    return np.array(observed)


def encoding(observations: np.ndarray) -> Box:
    """Return the range of every observation from recorded ones, but of commands from training."""
    # Quantiles, since a single stumble would widen the ranges that neurons represent.
    box = Box.around(np.quantile(observations, (TAIL, 1 - TAIL), axis=0), MARGIN)
    centre, half = box.centre.copy(), np.maximum(box.half, NARROWEST)
    (slowest, fastest), (_, turn) = COMMANDS
    centre[PARTS["command"]] = ((slowest + fastest) / 2, 0.0, 0.0)
    # No sideways speed is ever commanded.
    half[PARTS["command"]] = ((fastest - slowest) / 2, NARROWEST, turn)
    return Box(centre, half)


def clipped_shares(observations: np.ndarray, box: Box) -> dict[str, float]:
    """Return the share of values (n, 69) that are out of range, by part of an observation."""
    out = np.abs(observations - box.centre) > box.half * (1 + 1e-9)
    return {name: float(out[:, part].mean()) for name, part in PARTS.items()}
