"""A trial: one run of an experiment, from its robot and network to its figure."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Generic, Protocol, TypeVar

import nengo
import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from spikeport.backends.board.timing import WAITING
from spikeport.backends.step_log import KEPT_STEPS
from spikeport.constants import DT_S
from spikeport.errors import UsageError
from spikeport.experiments.calibration import DecoderCalibration
from spikeport.experiments.loop import Loop, Port
from spikeport.experiments.options import WITHOUT_NEURONS, Options
from spikeport.experiments.pictures import Film, Scenes
from spikeport.experiments.run_folder import Result
from spikeport.hardware_models import chip as chips
from spikeport.robot import menagerie
from spikeport.robot.altered import alter
from spikeport.robot.description import check_appearance, specified
from spikeport.robot.link.connection import RobotOptions, connect
from spikeport.robot.link.motion import EstimatedMotion
from spikeport.robot.link.plant import LinkedPlant
from spikeport.robot.perturbation import MENAGERIE, NONE, Perturbation
from spikeport.robot.perturbed_plant import PerturbedPlant
from spikeport.robot.plant import Plant
from spikeport.robot.pushes import EARLIEST
from spikeport.simulator import Simulator

WITHOUT_NEURONS_UNUSED = (
    f"on backend '{WITHOUT_NEURONS}', which has no neurons; cure: --backend native"
)
"""The reason why settings of neurons do nothing, for `Trial.unused`."""

R = TypeVar("R")
"""The record that a run of an experiment leaves."""


def needs(other: str) -> str:
    """Return the reason why a setting does nothing while another one is 0, for `Trial.unused`."""
    return f"without {other}, which is 0; cure: a value of {other} beside it"


class Settings(Protocol):
    """The settings that all experiments have; each has a dataclass of its own."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def network_seed(self) -> int:
        """Seed of the neurons."""

    @property
    def appearance(self) -> str:
        """The robot's appearance in pictures."""

    @property
    def files(self) -> list[Path]:
        """The files that a run reads."""


class Rig:
    """A robot, its ports and the loop that joins them; each experiment adds how a run begins.

    Parameters
    ----------
    plant : Plant
        The robot.
    ports : sequence of Port
        Its ports.
    dt_s : float
        Time step of the controller.
    gate : Port, optional
        A port that opens and closes other ports, see `Loop`.
    """

    def __init__(
        self, plant: Plant, ports: Sequence[Port], dt_s: float, gate: Port | None = None
    ) -> None:
        self.plant = plant
        self.film = Film(plant)
        # The film is last: it keeps the pose that the other ports acted on.
        self.loop = Loop(plant, [*ports, self.film], dt_s, gate)


K = TypeVar("K", bound=Rig)
"""The rig of an experiment."""


@dataclass(frozen=True)
class ClosedLoop(Generic[K]):
    """A controller and a robot in one network.

    Attributes
    ----------
    network : nengo.Network
        The network of both, connected.
    rig : Rig
        The robot.
    probes : mapping of str to nengo.Probe
        Probes of the controller, by name.
    """

    network: nengo.Network
    rig: K
    probes: Mapping[str, nengo.Probe]


class Trial(ABC, Generic[K, R]):
    """One run of an experiment, which `spikeport.experiments.driver.run` performs.

    Parameters
    ----------
    settings : dataclass
        The settings of the experiment.
    options : Options
        The options of the run.
    """

    name: ClassVar[str]
    anchored: ClassVar[bool] = False
    """True if the robot hangs by its pelvis from the start."""
    settings: Settings

    def __init__(self, settings: Settings, options: Options) -> None:
        self.settings = settings
        self.options = options

    def check(self) -> None:
        """Raise the UsageError or MissingExtraError that a run would raise, without running."""
        self._check_pushes()
        if self.perturbation.robot_model == MENAGERIE:
            menagerie.feet()
        check_appearance(self.settings.appearance)
        if self.settings.appearance == MENAGERIE:
            menagerie.model_file(menagerie.APPEARANCE)
        if self.perturbation.payload < 0:  # there may be nothing left of the torso
            alter(specified(), self.perturbation)

    def _check_pushes(self) -> None:
        """Refuse pushes of which none can come before the end of the run."""
        asked, seconds = self.perturbation, self.options.seconds
        earliest_s = EARLIEST * asked.push_every
        if asked.push and seconds <= earliest_s:
            raise UsageError(
                f"push={asked.push:g}: with push_every={asked.push_every:g} the first push comes "
                f"{earliest_s:g} s after the start or later, and the run ends at {seconds:g} s; "
                "cure: a smaller push_every, or more --seconds"
            )

    def calibrate(self) -> DecoderCalibration:
        """Refit decoders to the activity of neurons on the backend; UsageError without decoders."""
        raise UsageError(f"experiment '{self.name}' has no decoders to calibrate")

    @property
    def unused(self) -> dict[str, str]:
        """The settings that do nothing in this run, each with the reason and a cure."""
        if self.perturbation.push:
            return {}
        return {"push_every": needs("push")}

    @property
    def files(self) -> list[Path]:
        """The files that settings and chip name, which the run reads."""
        return [*self.settings.files, *chips.files_of(self.options.chip)]

    @property
    def perturbation(self) -> Perturbation:
        """The robot's perturbation; an experiment without such settings has none."""
        return NONE

    def plant(self) -> Plant:
        """Return the robot.

        Raises
        ------
        UsageError
            For an unknown appearance, a perturbation of a robot behind an interface, or a pause in
            which a robot in real time would have no commands.
        """
        asked, appearance = self.options.robot, self.settings.appearance
        if asked is None and self.perturbation == NONE:
            return Plant(anchored=self.anchored, appearance=appearance)
        if asked is None:
            return PerturbedPlant(self.perturbation, anchored=self.anchored, appearance=appearance)
        self._refuse_perturbation()
        if asked.real_time:
            self._refuse_pauses(asked)
        return LinkedPlant(
            partial(connect, asked, paced=self.options.link.real_time),
            partial(EstimatedMotion, asked.estimates),
            anchored=self.anchored,
            appearance=appearance,
        )

    def _refuse_perturbation(self) -> None:
        asked = [
            f"{one.name}={getattr(self.perturbation, one.name)}"
            for one in fields(NONE)
            if getattr(self.perturbation, one.name) != one.default
        ]
        if asked:
            raise UsageError(
                f"{', '.join(asked)}: perturbs the simulation in this process, and not a robot "
                "behind its interface; cure: leave out --robot, which has --robot-fault and "
                "--estimator of its own"
            )

    def _refuse_pauses(self, robot: RobotOptions) -> None:
        """Refuse what would leave a robot in real time without commands for too long."""
        options = self.options
        if options.counts is not None and options.seconds >= KEPT_STEPS * DT_S:
            raise UsageError(
                f"--counts: writes {KEPT_STEPS:,} steps at once, which takes longer than a robot "
                "in real time may be without commands; cure: leave it out, or --seconds below "
                f"{KEPT_STEPS * DT_S:g}"
            )
        waits = options.backend == "board" and not options.link.real_time
        if waits and robot.may_be_real:
            raise UsageError(
                f"--backend board in simulated time: the run waits up to {WAITING.limit} for each "
                "answer, and meanwhile neither commands a real robot nor reads a stop; cure: "
                "--real-time"
            )

    @abstractmethod
    def close_loop(self, plant: Plant) -> ClosedLoop[K]:
        """Build the controller, in closed loop with a robot.

        Raises
        ------
        UsageError
            If the trial asks for something that cannot be done.
        """

    @abstractmethod
    def begin(self, rig: K) -> None:
        """Put the robot where the run begins, and set its task."""

    def network(self) -> nengo.Network:
        """Return the network to compile; its image is the same as in a run."""
        closed = self.close_loop(self.plant())
        self.begin(closed.rig)
        return closed.network

    @abstractmethod
    def record(self, closed: ClosedLoop[K], sim: Simulator, wall_s: float) -> R:
        """Return the record of a run that took ``wall_s`` of wall-clock time."""

    @abstractmethod
    def metrics(self, run: R) -> dict[str, object]:
        """Return the figures of a run."""

    def amounts(self, run: R) -> Mapping[str, float]:
        """Return the amount of the robot's work in each unit, other than seconds."""
        return {}

    @abstractmethod
    def probes(self, run: R) -> xr.Dataset:
        """Return the time series of a run, with names and units."""

    @abstractmethod
    def scenes(self, run: R) -> Scenes:
        """Return the scenes for pictures of a run."""

    @abstractmethod
    def figure(self, run: R, pictures: Sequence[np.ndarray], result: Result) -> Figure:
        """Draw the figure of a run.

        Parameters
        ----------
        run
            The results and recordings of the run.
        pictures : sequence of (height, width, 3) arrays
            The pictures of its scenes; empty without graphics.
        result : dict
            The content of ``result.json``.
        """
