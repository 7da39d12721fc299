"""The hoist of a simulated robot: it holds the pelvis, lets it down, and lets go of it."""

from enum import Enum

from spikeport.robot.plant import Plant

LOWERS_M_S = 0.05
"""Speed at which the pelvis is let down."""


class Held(Enum):
    """The hold of a hoist on a robot, from one `Hoist.advance` to the next."""

    HANGS = "hangs on its hoist"
    LOWERS = "is being lowered to the floor"
    STANDS = "stands on the floor, and its hoist still holds it"
    FREE = "is released from its hoist"


class Hoist:
    """The hoist of a plant, which holds it by its pelvis if the plant is anchored.

    Parameters
    ----------
    plant : Plant
        The robot.

    Attributes
    ----------
    held : Held
        The present hold on the robot.
    """

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self.held = Held.HANGS if plant.anchored else Held.FREE

    def advance(self) -> None:
        """Begin to lower a hanging robot to the floor, or let go of a standing one."""
        plant = self._plant
        if self.held is Held.HANGS:
            self.held = Held.LOWERS
            self._pose = plant.data.qpos[:7].copy()
            self._torso_rad = float(plant.data.joint("torso").qpos[0])
        elif self.held is Held.STANDS:
            self.held = Held.FREE
            plant.release()

    def step(self) -> None:
        """Lower a robot on its way down by the distance of one step, until it stands."""
        if self.held is not Held.LOWERS:
            return
        # Measured in each step: a robot on its way down may bend and stretch its legs.
        if self._plant.lowest_sole_m() <= 0:
            self.held = Held.STANDS
            return
        # The weld itself is lowered: it pulls the pelvis along, and yields a little.
        self._pose[2] -= LOWERS_M_S * self._plant.dt_s
        self._plant.anchor(self._pose, self._torso_rad)
