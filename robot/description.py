"""The Unitree H1: its model, its joints, its default pose and its joint gains."""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from spikeport.errors import unknown
from spikeport.robot import menagerie
from spikeport.robot.engine import mujoco

MODEL_PATH = Path(__file__).with_name("h1.xml")

_LEG = ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle")
_ARM = ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow")

JOINTS: tuple[str, ...] = (
    *(f"left_{role}" for role in _LEG),
    *(f"right_{role}" for role in _LEG),
    "torso",
    *(f"left_{role}" for role in _ARM),
    *(f"right_{role}" for role in _ARM),
)
"""The 19 hinge joints in the order of the model, of its actuators and of every joint vector."""

ARM_JOINTS: tuple[str, ...] = tuple(f"right_{role}" for role in _ARM)
"""The four joints of the right arm, from the shoulder outwards."""


class Gain(NamedTuple):
    """A joint's position control: torque = kp (target - q) - kd dq, in N m/rad and N m s/rad."""

    kp: float
    kd: float


# The H1's walking policies are trained with these gains and this pose (Isaac Lab, unitree H1).
_ARM_GAIN = Gain(40.0, 10.0)
_GAINS = {
    "hip_yaw": Gain(150.0, 5.0),
    "hip_roll": Gain(150.0, 5.0),
    "hip_pitch": Gain(200.0, 5.0),
    "knee": Gain(200.0, 5.0),
    "ankle": Gain(20.0, 4.0),
    "torso": Gain(200.0, 5.0),
    **dict.fromkeys(_ARM, _ARM_GAIN),
}
_ANGLES_RAD = {
    "hip_pitch": -0.28,
    "knee": 0.79,
    "ankle": -0.52,
    "shoulder_pitch": 0.28,
    "elbow": 0.52,
}


def _role(joint: str) -> str:
    return joint.removeprefix("left_").removeprefix("right_")


DEFAULT_POSE: dict[str, float] = {j: _ANGLES_RAD.get(_role(j), 0.0) for j in JOINTS}
"""Joint angles (rad) of the slightly crouched stand, in the order of ``JOINTS``."""

GAINS: dict[str, Gain] = {j: _GAINS[_role(j)] for j in JOINTS}
"""Default position gains of every joint."""


def _fixed(values: Iterable[float]) -> np.ndarray:
    array = np.array(list(values))
    array.setflags(write=False)
    return array


POSE_RAD = _fixed(DEFAULT_POSE.values())
"""The default pose, ``(19,)``."""

ARM_POSE_RAD = _fixed(DEFAULT_POSE[joint] for joint in ARM_JOINTS)
"""The default pose of the right arm, ``(4,)``."""

KP, KD = (_fixed(column) for column in zip(*GAINS.values(), strict=True))
"""The default gains, ``(19,)`` each, in N m/rad and N m s/rad."""

_APPEARANCES = {"primitive": lambda spec: None, "menagerie": menagerie.dress}


def load(appearance: str = "primitive") -> mujoco.MjModel:
    """Compile the model of the robot on a floor; see `specified`."""
    return specified(appearance).compile()


def check_appearance(appearance: str) -> None:
    """Raise UsageError unless the appearance is one that `specified` knows."""
    if appearance not in _APPEARANCES:
        raise unknown("appearance", appearance, _APPEARANCES)


def specified(appearance: str = "primitive") -> mujoco.MjSpec:
    """Return the model of the robot on a floor, to be compiled.

    Masses, joints, contacts and actuators are the same under every appearance.

    Parameters
    ----------
    appearance : str
        ``"primitive"``: boxes, capsules and ellipsoids, always available; ``"menagerie"``: the
        visual meshes of MuJoCo Menagerie, which must already be on this machine.

    Raises
    ------
    UsageError
        The appearance is not known, or Menagerie's files are not on this machine.
    MissingExtraError
        The package ``mujoco-menagerie`` is absent.
    """
    check_appearance(appearance)
    spec = mujoco.MjSpec.from_file(str(MODEL_PATH))
    _APPEARANCES[appearance](spec)
    return spec
