"""The free H1 in closed loop with a walking controller.

Physics runs at 200 Hz with joint targets held between its steps, the controller at 1 kHz; one after
the other in lock-step, so that a run depends on its seeds alone.
"""

from collections import deque
from collections.abc import Sequence

import nengo
import numpy as np

from spikeport.errors import DivergedError
from spikeport.experiments.walk.paths import Path
from spikeport.experiments.walk.recording import Recording, Sample, fallen
from spikeport.networks.path_following import COMMAND_SIZE, REFERENCE_SIZE, STATE_SIZE
from spikeport.networks.region import Box
from spikeport.robot.description import JOINTS
from spikeport.robot.feet import Feet
from spikeport.robot.plant import Plant
from spikeport.robot.state import PELVIS
from spikeport.robot.walk_interface import (
    ACTION_SIZE,
    COMMAND_CHANGE_PER_S,
    CONTROL_DT_S,
    OBSERVATION_SIZE,
    observation,
    targets_rad,
)

LEAD_S = 0.8
"""How far the reference is ahead of the robot at the start: on the robot, the direction to it would
be that of the gait's sway."""

OBSERVATION_DT_S = 0.005
"""Time from one observation of a spiking policy to the next."""

OUTPUTS = np.cumsum([OBSERVATION_SIZE, REFERENCE_SIZE, STATE_SIZE]).tolist()
"""Where observation, reference and state end in what the plant shows."""


class WalkLoop:
    """Plant and path, stepped by the actions and commands of a controller.

    Parameters
    ----------
    encoding : Box or None
        Range of the observations that the controller can be told; what is beyond is clipped.
    observe_every_s : float
        Time from one observation to the next, a multiple of the physics step.
    dt_s : float
        Time step of the controller, of which the physics step is a multiple.
    appearance : str
        How the robot looks in pictures, see `spikeport.robot.description.load`.

    Attributes
    ----------
    poses : list of array
        MuJoCo's ``qpos`` at every physics step.
    fallen_at_s : float or None
        When the robot fell.
    """

    def __init__(
        self,
        encoding: Box | None,
        observe_every_s: float,
        dt_s: float,
        appearance: str = "primitive",
    ) -> None:
        self.plant = Plant(appearance=appearance)
        self.encoding = encoding
        self._feet = Feet(self.plant.model)
        self._observe_steps = round(observe_every_s / self.plant.dt_s)
        self._command_change = (COMMAND_CHANGE_PER_S * observe_every_s).tolist()
        self._n_last = 2 * round(CONTROL_DT_S / observe_every_s) - 1
        self._ticks = round(self.plant.dt_s / dt_s)

    def begin(self, seed: int, path: Path) -> None:
        """Put the robot at the start of a path, standing as a seed varies it."""
        self.plant.reset(seed)
        self._follow(path)
        self.fallen_at_s: float | None = None
        self.poses: list[np.ndarray] = []
        self._samples: list[Sample] = []
        self._last = deque(np.zeros((self._n_last, ACTION_SIZE)), self._n_last)
        self._tick, self._told = 0, [0.0] * len(COMMAND_CHANGE_PER_S)
        self._observe(np.zeros(COMMAND_SIZE))
        self._locate()

    def _follow(self, path: Path) -> None:
        """Begin a path now."""
        self.path, self._path_begun_s = path, self.plant.time_s

    @property
    def over(self) -> bool:
        """Whether there is nothing left to do: the robot fell."""
        return self.fallen_at_s is not None

    def recording(self) -> Recording:
        """What was seen and done so far."""
        return Recording(*(np.array(column) for column in zip(*self._samples, strict=True)))

    def step(self, output: np.ndarray) -> np.ndarray:
        """One step of the controller: [action, command] in, [observation, reference, state] out."""
        self._tick += 1
        if self._tick % self._ticks == 0:
            self._physics(output.copy())
        return self._shown

    def _physics(self, given: np.ndarray) -> None:
        plant = self.plant
        action, command = given[:ACTION_SIZE], given[ACTION_SIZE:]
        self._record(action, command)
        if np.count_nonzero(np.isfinite(given)) < len(given):
            raise DivergedError(
                f"the controller's action or command is not finite at {plant.time_s:.3f} s, limit "
                "finite numbers; cure: look at its inputs in the last states"
            )
        self._drive(action)
        plant.step()
        if fallen(plant.data.qpos[2], plant.data.xmat[PELVIS][8]):
            self.fallen_at_s = plant.time_s
        if len(self._samples) % self._observe_steps == 0:
            self._observe(command)
        self._locate()

    def _drive(self, action: np.ndarray) -> None:
        self.plant.hold(JOINTS, targets_rad(action))

    def _record(self, action: np.ndarray, command: np.ndarray) -> None:
        data = self.plant.data
        seen = (self._observation, self._reference, self._state, action, command)
        on_floor = self._feet.on_floor(data)
        self._samples.append(Sample(self.plant.time_s, *seen, data.qpos[2], on_floor))
        self.poses.append(data.qpos.copy())

    def _observe(self, command: np.ndarray) -> None:
        """Look at the robot's motion; no robot is told to go sideways.

        What it is told changes no faster than in training, as from a walk to a stand.

        The last action is that of 20 ms before, as in training, in mean over as much to both sides
        as observations lie between. Were it one alone, policies that observe every 5 ms would be
        four in turn, each with its own last action, and might lift different feet: with noise of
        0.015 rad, 10 of 24 robots with one policy fell as they set off; in mean, none.
        """
        if self._samples:
            self._last.append(self._samples[-self._observe_steps].action)
        wanted = command.item(0), 0.0, command.item(1)
        steps = zip(self._told, wanted, self._command_change, strict=True)
        self._told = [told + min(max(end - told, -most), most) for told, end, most in steps]
        seen = observation(self.plant.state, self._told, np.mean(self._last, axis=0))
        self._observation = seen
        self._clipped = seen if self.encoding is None else self.encoding.clip(seen)

    def _locate(self) -> None:
        """Look where the robot is, and where it is to be."""
        data = self.plant.data
        self._state = np.array((self._heading_rad(), *data.qpos[:2], *data.qvel[:2]))
        self._reference = self.path.at(self.plant.time_s - self._path_begun_s + LEAD_S)
        self._shown = np.concatenate((self._clipped, self._reference, self._state))

    def _heading_rad(self) -> float:
        pelvis = self.plant.data.xmat[PELVIS]
        return float(np.arctan2(pelvis[3], pelvis[0]))


class LoopedNetwork(nengo.Network):
    """What walks the robot: inputs ``observation``, ``reference`` and ``state``, outputs ``action``
    and ``command``.

    ``spikes`` are probes of some of its neurons, if they are to be kept.
    """

    spikes: Sequence[nengo.Probe] = ()
    observation: nengo.Node
    reference: nengo.Node
    state: nengo.Node
    action: nengo.Node
    command: nengo.Node


def close_loop(controller: LoopedNetwork, loop: WalkLoop) -> None:
    """Connect a controller of the current network with the plant, through connections only."""
    plant = nengo.Node(
        lambda _t, output: loop.step(output),
        size_in=ACTION_SIZE + COMMAND_SIZE,
        size_out=OUTPUTS[-1],
        label="plant",
    )
    observed, followed, _ = OUTPUTS
    nengo.Connection(plant[:observed], controller.observation, synapse=None)
    nengo.Connection(plant[observed:followed], controller.reference, synapse=None)
    nengo.Connection(plant[followed:], controller.state, synapse=None)
    nengo.Connection(controller.action, plant[:ACTION_SIZE], synapse=None)
    nengo.Connection(controller.command, plant[ACTION_SIZE:], synapse=None)
