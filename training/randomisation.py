"""Differences from one training robot to the next, and from one step to the next."""

from dataclasses import dataclass, field

import numpy as np

from spikeport.robot import actuators
from spikeport.robot.description import KD, KP
from spikeport.robot.engine import mujoco
from spikeport.robot.walk_interface import OBSERVATION_SIZE, PARTS
from spikeport.training.model import floor_pairs
from spikeport.training.terrain import Terrain
from spikeport.training.velocity_belief import EstimatorErrors

SUBSTEPS = 4
"""Physics steps within a control step."""


@dataclass(frozen=True)
class Randomisation:
    """Ranges of uniform draws; ``_sd`` are standard deviations of normal ones.

    Per episode: ground and friction, scales of armature, damping, gains and of all masses, change
    of the torso's mass and centre of mass, delays of actions and of observations in physics steps,
    estimator of the velocity, offset of every joint's target, and whether an arm is busy while the
    robot stands (the share of robots). Per step: noise of observations and of joint targets (in
    actions), pushes (changes of the horizontal velocity, about every ``push_every_s``).
    """

    friction: tuple[float, float] = (0.5, 1.2)
    armature: tuple[float, float] = (0.3, 1.1)
    damping: tuple[float, float] = (0.2, 1.2)
    gain: tuple[float, float] = (0.9, 1.1)
    mass: tuple[float, float] = (1.0, 1.0)
    torso_mass_kg: float = 2.0
    torso_com_m: float = 0.02
    delay_steps: tuple[int, int] = (0, 4)
    observation_delay_steps: tuple[int, int] = (0, 0)
    observation_noise: float = 1.0
    push_m_s: float = 0.2
    push_every_s: float = 5.0
    joint_offset_sd_rad: float = 0.0
    action_noise_sd: float = 0.0
    busy_arms: float = 0.0
    terrain: Terrain = field(default_factory=Terrain)
    estimator: EstimatorErrors = field(default_factory=EstimatorErrors)


UNDISTURBED = Randomisation(
    friction=(1.0, 1.0),
    armature=(1.0, 1.0),
    damping=(1.0, 1.0),
    gain=(1.0, 1.0),
    torso_mass_kg=0.0,
    torso_com_m=0.0,
    delay_steps=(0, 0),
    observation_noise=0.0,
    push_m_s=0.0,
)
"""The robot as it is described, undisturbed."""


def observation_noise() -> np.ndarray:
    """Return the half widths of the noise on every observation, ``(69,)``."""
    width = np.zeros(OBSERVATION_SIZE)
    for part, value in {
        "linear velocity": 0.05,
        "angular velocity": 0.1,
        "gravity": 0.03,
        "command": 0.05,
        "joint angles": 0.01,
        "joint velocities": 0.5,
    }.items():
        width[PARTS[part]] = value
    return width


class Bodies:
    """Random physics of one robot, drawn from the figures of an unchanged one.

    Parameters
    ----------
    nominal : mujoco.MjModel
        The unchanged model.
    """

    def __init__(self, nominal: mujoco.MjModel) -> None:
        self._nominal = nominal
        self._floors = floor_pairs(nominal)
        self._torso = nominal.body("torso_link").id

    def draw(self, model: mujoco.MjModel, ranges: Randomisation, rng: np.random.Generator) -> None:
        """Give ``model`` other friction, inertia and gains; lengths do not change."""
        nominal = self._nominal
        # Sliding friction along both tangents of a contact.
        model.pair_friction[self._floors, :2] = rng.uniform(*ranges.friction)
        # The first six degrees of freedom are the free joint's: the pelvis has neither motor nor
        # bearing.
        model.dof_armature[6:] = nominal.dof_armature[6:] * rng.uniform(*ranges.armature)
        model.dof_damping[6:] = nominal.dof_damping[6:] * rng.uniform(*ranges.damping)
        kp = KP * rng.uniform(*ranges.gain, len(KP))
        kd = KD * rng.uniform(*ranges.gain, len(KD))
        actuators.set_position_mode(model, np.arange(model.nu), kp, kd)
        scale = rng.uniform(*ranges.mass)
        model.body_mass[:] = scale * nominal.body_mass
        model.body_inertia[:] = scale * nominal.body_inertia
        com = nominal.body_ipos[self._torso]
        model.body_mass[self._torso] += ranges.torso_mass_kg * rng.uniform(-1, 1)
        model.body_ipos[self._torso] = com + ranges.torso_com_m * rng.uniform(-1, 1, 3)
