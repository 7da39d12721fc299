"""Reach-to-target: the right arm follows random targets (paper, sec. 4.1 and Fig. 4)."""

import dataclasses
import time
from dataclasses import dataclass
from typing import Any

import nengo
from nengo.exceptions import SimulationError

from spikeport.errors import DivergedError, UsageError, unknown
from spikeport.experiments import run_folder
from spikeport.experiments.arm_loop import ArmLoop, close_loop, record_region
from spikeport.experiments.on_chip import on_chip
from spikeport.experiments.options import Experiment, Options, Outcome
from spikeport.experiments.reach_figure import draw
from spikeport.experiments.reach_metrics import metrics
from spikeport.experiments.reach_picture import check_video, picture, write_video
from spikeport.experiments.reach_probes import write_probes
from spikeport.experiments.reach_task import BOXES, ReachTask, TargetBox
from spikeport.networks.arm import PRESETS, ArmNetwork, ArmSizes, analytic_arm, arm
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.robot.arm import ArmDynamics
from spikeport.simulator import Simulator

DT_S = 0.001
LARGEST_SEED = 2**32 - 1
"""Of NumPy's random states."""


@dataclass(frozen=True)
class ReachSettings:
    """Settings of the experiment.

    ``box`` is where targets appear, ``preset`` the size of the controller; ``m1``, ``cb`` and
    ``s1`` replace its neurons per axis, ensemble and dimension. ``network_seed`` draws the neurons.
    ``appearance`` is that of the robot in pictures: ``primitive``, or ``menagerie`` for meshes.
    """

    box: str = "small"
    preset: str = "lean"
    m1: int | None = None
    cb: int | None = None
    s1: int | None = None
    network_seed: int = 0
    appearance: str = "primitive"

    def __post_init__(self) -> None:
        """Check the values; UsageError says what is wrong."""
        if self.box not in BOXES:
            raise unknown("box", self.box, BOXES)
        if self.preset not in PRESETS:
            raise unknown("preset", self.preset, PRESETS)
        for key, value in self._given_sizes().items():
            if value < 1:
                raise UsageError(f"{key}={value}: the number of neurons must be at least 1")
        if not 0 <= self.network_seed <= LARGEST_SEED:
            raise UsageError(
                f"network_seed={self.network_seed}: a seed must be from 0 to {LARGEST_SEED}"
            )

    def _given_sizes(self) -> dict[str, int]:
        sizes = {"m1": self.m1, "cb": self.cb, "s1": self.s1}
        return {key: value for key, value in sizes.items() if value is not None}

    @property
    def target_box(self) -> TargetBox:
        """Where targets appear."""
        return BOXES[self.box]

    @property
    def sizes(self) -> ArmSizes:
        """Neuron counts of the controller."""
        return dataclasses.replace(PRESETS[self.preset], **self._given_sizes())


def arm_network(
    box: str = "small",
    preset: str = "lean",
    m1: int | None = None,
    cb: int | None = None,
    s1: int | None = None,
    network_seed: int = 0,
) -> nengo.Network:
    """The spiking arm controller for one target box: the built-in network ``arm``.

    It gives the image that the experiment runs, digest and all: the robot is not part of it.
    """
    settings = ReachSettings(box, preset, m1, cb, s1, network_seed)
    with nengo.Network(label="reach", seed=network_seed) as network:
        _controller(settings)
    return network


def _controller(settings: ReachSettings) -> ArmNetwork:
    law = OperationalSpaceLaw(ArmDynamics())
    region = record_region(law, settings.target_box)
    return arm(law, region, settings.sizes, seed=settings.network_seed)


def run(settings: ReachSettings, options: Options) -> Outcome:
    """Run the experiment and write its folder."""
    law = OperationalSpaceLaw(ArmDynamics())
    loop = ArmLoop(law, options.seed, DT_S, settings.appearance)
    if options.video:
        check_video(options.folder, loop)
    task = ReachTask(settings.target_box, options.seed, loop.plant.hand_position())
    loop.begin(task)
    analytic = options.backend == "analytic"
    options.progress("building the controller", None)
    with nengo.Network(label="reach", seed=settings.network_seed) as network:
        controller = analytic_arm(law) if analytic else _controller(settings)
        close_loop(controller, loop)
    backend = "reference" if analytic else options.backend
    options.progress("compiling", None)
    with Simulator(network, chip=options.chip, backend=backend, dt=DT_S, seed=options.seed) as sim:
        wall_s = _simulate(sim, loop, options)
    recording = loop.recording()
    exact = recording.exact_torque(law)
    figures = metrics(recording, exact, task.reach_times_s, sim, wall_s)
    rasters = {axis: sim.data[probe] != 0 for axis, probe in controller.rasters.items()}
    result = _result(settings, options, sim, figures)
    options.progress("writing", None)
    run_folder.clear(options.folder)
    write_probes(options.folder, recording, exact, rasters, DT_S)
    draw(options.folder, recording, rasters, result, picture(loop))
    if options.video:
        write_video(options.folder, loop)
    run_folder.write_result(options.folder, result)
    report = None if sim.compilation is None else sim.compilation.report
    return Outcome(result, report, sim.activity)


def _simulate(sim: Simulator, loop: ArmLoop, options: Options) -> float:
    """Run all steps; returns the wall-clock time they took, in seconds."""
    steps = round(options.seconds / DT_S)
    start = time.perf_counter()
    try:
        for i in range(steps):
            sim.step()
            if i % 50 == 0:
                options.progress("simulating", i / steps)
    except (DivergedError, SimulationError) as error:  # Nengo's: a node gave NaN or infinity
        path = run_folder.write_last_states(options.folder, loop.plant.history())
        raise DivergedError(f"{error}; the last states are in {path}") from error
    return time.perf_counter() - start


def _result(
    settings: ReachSettings, options: Options, sim: Simulator, figures: dict[str, Any]
) -> dict[str, Any]:
    """What ``result.json`` holds, but for schema and versions."""
    return {
        "command": list(options.command),
        "experiment": EXPERIMENT.name,
        "backend": options.backend,
        "seconds": options.seconds,
        "seeds": {"run": options.seed, "network": settings.network_seed},
        "settings": dataclasses.asdict(settings),
        "metrics": figures,
        "activity": sim.activity.totals(),
        **on_chip(sim),
    }


EXPERIMENT = Experiment(
    name="reach",
    summary="the right arm follows random targets",
    settings=ReachSettings,
    run=run,
    backends=("analytic", "reference", "native", "nengo-loihi"),
    seconds=15.0,
    step_s=0.005,
)
