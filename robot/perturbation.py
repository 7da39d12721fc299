"""Perturbations: differences of robot and surroundings from those that controllers are made for."""

import math
from dataclasses import dataclass, fields

from spikeport.errors import UsageError, unknown
from spikeport.robot.estimator.registry import TRUTH, WITHOUT_ODOMETRY
from spikeport.robot.terrain import FLAT, find_terrain
from spikeport.robot.times import PHYSICS_DT_S

OWN, URDF, MENAGERIE = "own", "urdf", "menagerie"
ROBOT_MODELS = (OWN, URDF, MENAGERIE)
LONGEST_DELAY_S = 0.5
ROUNDING = 1e-6

_BOUNDS = {
    "friction": (0.01, 10.0, ""),
    "mass": (0.1, 10.0, ""),
    "payload": (-10.0, 100.0, " kg"),
    "com_x": (-0.5, 0.5, " m"),
    "com_y": (-0.5, 0.5, " m"),
    "gains": (0.0, 10.0, ""),
    "strength": (0.0, 10.0, ""),
    "action_delay": (0.0, LONGEST_DELAY_S, " s"),
    "observation_delay": (0.0, LONGEST_DELAY_S, " s"),
    "sensor_noise": (0.0, 100.0, ""),
    "push": (0.0, 10.0, " m/s"),
    "push_every": (0.1, 1000.0, " s"),
}


@dataclass(frozen=True, kw_only=True)
class Perturbation:
    """The perturbations of a simulated robot; by default none.

    ``robot_model`` is ``own``, ``urdf`` (masses and ranges of Unitree's h1.urdf) or ``menagerie``
    (the feet of MuJoCo Menagerie's H1, which must be on this machine). ``friction`` is the floor's
    coefficient. ``mass`` scales all masses and inertias, ``payload`` adds kg to the torso, and
    ``com_x`` and ``com_y`` move its centre of mass forwards and to the left, in m. ``gains`` scales
    the gains of the joints, ``strength`` their torque limits. ``action_delay`` and
    ``observation_delay`` are in s, multiples of 0.005; the first delays the commands of all joints,
    the arm's too. ``sensor_noise`` scales the noise of sensors; 1 is Isaac Lab's (docs/walk.md).
    ``push`` changes the horizontal velocity by this many m/s in a random direction, about every
    ``push_every`` s. ``terrain`` is ``flat``, ``slope:DEGREES`` or ``slope:DEGREES:SIDE``,
    ``boxes:M`` (boxes of 0.4 m, up to M m high) or ``relief:M`` (waves up to M m high).
    ``estimator`` finds the motion that policy and follower observe: ``truth``, ``leg-odometry`` or
    ``ekf``. Sensor noise, a delay of the observation and the estimator affect only the observations
    of these two; the arm observes the truth.
    """

    robot_model: str = OWN
    friction: float = 1.0
    mass: float = 1.0
    payload: float = 0.0
    com_x: float = 0.0
    com_y: float = 0.0
    gains: float = 1.0
    strength: float = 1.0
    action_delay: float = 0.0
    observation_delay: float = 0.0
    sensor_noise: float = 0.0
    push: float = 0.0
    push_every: float = 5.0
    terrain: str = FLAT
    estimator: str = TRUTH

    def __post_init__(self) -> None:
        """Check the values; raise UsageError for the first wrong one."""
        if self.robot_model not in ROBOT_MODELS:
            raise unknown("robot_model", self.robot_model, ROBOT_MODELS)
        if self.estimator not in WITHOUT_ODOMETRY:
            raise unknown("estimator", self.estimator, WITHOUT_ODOMETRY)
        for name, (low, high, unit) in _BOUNDS.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise UsageError(f"{name}={value:g}: must be from {low:g} to {high:g}{unit}")
        for name in ("action_delay", "observation_delay"):
            _check_whole(name, getattr(self, name))
        find_terrain(self.terrain)

    @property
    def perturbation(self) -> "Perturbation":
        """The perturbation alone, without the other fields of a subclass."""
        return Perturbation(**{one.name: getattr(self, one.name) for one in fields(Perturbation)})


def _check_whole(name: str, delay_s: float) -> None:
    steps = delay_s / PHYSICS_DT_S
    if not math.isclose(steps, round(steps), abs_tol=ROUNDING):
        raise UsageError(
            f"{name}={delay_s:g}: a delay must be a whole number of the physics' steps of "
            f"{PHYSICS_DT_S:g} s; the nearest is {round(steps) * PHYSICS_DT_S:g}"
        )


NONE = Perturbation()
"""No perturbation: the robot that controllers are made for."""
