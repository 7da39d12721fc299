"""A trial of the arm; each experiment of the arm adds its task, metrics and figure."""

import dataclasses
from abc import abstractmethod
from collections.abc import Iterable, Mapping
from functools import cached_property
from pathlib import Path

import nengo
import numpy as np
import xarray as xr

from spikeport.cache import Arrays
from spikeport.constants import DT_S
from spikeport.experiments.arm.calibration import METHOD, draw_states, refit_arm
from spikeport.experiments.arm.port import ArmRig
from spikeport.experiments.arm.reachability import check_in_region, check_reachable
from spikeport.experiments.arm.recording import ArmRecording, ArmRun, ArmTask, dataset
from spikeport.experiments.arm.region import Rehearsal, record_region
from spikeport.experiments.arm.settings import OF_NEURONS, ArmSettings
from spikeport.experiments.calibration import DecoderCalibration, Refitted, load, no_neurons
from spikeport.experiments.pictures import Marks, Scenes
from spikeport.experiments.trial import WITHOUT_NEURONS_UNUSED, ClosedLoop, Trial
from spikeport.hardware_models import chip as chips
from spikeport.networks.arm import ArmNetwork, analytic_arm, arm
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.networks.region import ArmRegion
from spikeport.robot.arm import ArmDynamics
from spikeport.robot.plant import Plant
from spikeport.robot.render import Mark
from spikeport.simulator import Simulator

TRACE_MARKS = 800
TARGET_RGBA = (0.95, 0.45, 0.05, 1.0)
TRACE_RGBA = (0.1, 0.65, 0.25, 1.0)


class ArmTrial(Trial[ArmRig, ArmRun]):
    """The base of all runs of the arm."""

    anchored = True
    settings: ArmSettings

    @abstractmethod
    def task(self, hand: np.ndarray) -> ArmTask:
        """Return the task of the arm, whose hand is at (3,) in m."""

    @abstractmethod
    def rehearsals(self) -> Iterable[Rehearsal]:
        """Return runs of the exact law that pass through the states the task needs."""

    @property
    @abstractmethod
    def rehearsed_settings(self) -> dict[str, object]:
        """The settings that the rehearsals depend on."""

    @property
    def rehearsed_values(self) -> dict[str, object]:
        """The values of `rehearsed_settings`: kept results do not depend on how they were typed."""
        return self.rehearsed_settings

    @property
    @abstractmethod
    def goal(self) -> str:
        """The goal in words, for messages."""

    @abstractmethod
    def goal_points(self) -> np.ndarray:
        """Return the points (n, 3) in m that the hand must be able to reach."""

    @abstractmethod
    def trace_since(self, time_s: float) -> float:
        """Return the time from which a picture at ``time_s`` shows the hand's trace, in s."""

    @property
    def network_settings(self) -> dict[str, object]:
        """The settings that the controller depends on."""
        sizes = dataclasses.asdict(self.settings.sizes)
        return {**sizes, "network_seed": self.settings.network_seed, **self.rehearsed_settings}

    @cached_property
    def dynamics(self) -> ArmDynamics:
        """The arm."""
        return ArmDynamics()

    @cached_property
    def law(self) -> OperationalSpaceLaw:
        """The exact law."""
        return OperationalSpaceLaw(self.dynamics)

    def check(self) -> None:
        """Refuse a goal out of reach, and a calibration for another controller."""
        super().check()
        check_reachable(self.goal, self.goal_points())
        asked = self.settings.calibrated
        if asked and self._exact:
            raise no_neurons(asked, f"backend '{self.options.backend}'", "give --backend native")
        if isinstance(asked, str):
            self._loaded(asked)

    @property
    def unused(self) -> dict[str, str]:
        """The settings that do nothing in this run: those of neurons if there are none."""
        return dict.fromkeys(OF_NEURONS, WITHOUT_NEURONS_UNUSED) if self._exact else {}

    # the controller

    @property
    def _exact(self) -> bool:
        """True if the law is computed without neurons."""
        return not self.options.has_neurons

    def spiking_controller(self) -> ArmNetwork:
        """Rehearse the task, and build the controller for the states that the task needs.

        Raises
        ------
        UsageError
            If a point of the goal is not among those states, or the calibration was made for
            another controller.
        """
        asked = self.settings.calibrated
        calibration = self._loaded(asked) if isinstance(asked, str) else None
        region = self._rehearsed()
        if asked is True:
            calibration = self._calibrated(region)
        self.options.progress("building the controller", None)
        decoders = None if calibration is None else calibration.decoders
        return self._arm(region, decoders, self.settings.efference_copy)

    def calibrate(self) -> DecoderCalibration:
        """Refit the controller's decoders to the firing of its neurons on the backend."""
        return self._calibrated(self._rehearsed())

    def _loaded(self, file: str) -> DecoderCalibration:
        return load(Path(file), self._made_for, self.settings.sizes.decoders)

    def _rehearsed(self) -> ArmRegion:
        def rehearse() -> Arrays:
            self.options.progress("rehearsing with the exact law", None)
            return record_region(self.law, self.rehearsals()).arrays()

        inputs = {"experiment": self.name, **self.rehearsed_values}
        region = ArmRegion.of(self.options.cache.kept("rehearsal", inputs, rehearse))
        check_in_region(self.goal, self.goal_points(), region)
        return region

    def _calibrated(self, region: ArmRegion) -> DecoderCalibration:
        def refit() -> Arrays:
            held = draw_states(self.law, region)
            return refit_arm(self._arm(region), held, self.options, DT_S).arrays()

        inputs = ({**self._made_for, **self.rehearsed_values}, chips.get(self.options.chip), region)
        found = self.options.cache.kept("arm", inputs, refit)
        return Refitted.of(found).made_for(self._made_for)

    def _arm(
        self,
        region: ArmRegion,
        decoders: Mapping[str, np.ndarray] | None = None,
        efference_copy: bool = False,
    ) -> ArmNetwork:
        """Build the controller; ``decoders`` replace the ones solved for float neurons."""
        return arm(
            self.law,
            region,
            self.settings.sizes,
            seed=self.settings.network_seed,
            decoders=decoders,
            efference_copy=efference_copy,
        )

    @property
    def _made_for(self) -> dict[str, object]:
        """Everything that the controller and its neurons depend on, and the method of refitting."""
        made = {"experiment": self.name, "method": METHOD}
        return {**made, **self.network_settings, **self.options.substrate}

    # the run

    def close_loop(self, plant: Plant) -> ClosedLoop[ArmRig]:
        """Build the controller in closed loop with the arm.

        Raises
        ------
        UsageError
            If a point of the goal is out of the arm's reach, or as `spiking_controller`.
        """
        # Checked before the controller is built, since the goal may be out of reach.
        self.check()
        built = analytic_arm(self.law) if self._exact else self.spiking_controller()
        rig = ArmRig(plant, self.law, DT_S)
        with nengo.Network(label=self.name, seed=self.settings.network_seed) as network:
            network.add(built)
            rig.loop.connect([built.state, built.target], [built.torque])
        return ClosedLoop(network, rig, built.rasters)

    def network(self) -> nengo.Network:
        """Return the spiking controller, without the robot."""
        built = self.spiking_controller()
        with nengo.Network(label=self.name, seed=self.settings.network_seed) as network:
            network.add(built)
            nengo.Probe(built.torque)  # neurons that lead nowhere are not compiled
        return network

    def begin(self, rig: ArmRig) -> None:
        """Put the arm into its posture at rest, and begin the task."""
        rig.begin(self.options.seed, self.task)

    def record(self, closed: ClosedLoop[ArmRig], sim: Simulator, wall_s: float) -> ArmRun:
        """Return the recording, with the torques of the exact law at the same states."""
        recording = closed.rig.port.recording()
        return ArmRun(
            recording=recording,
            task=closed.rig.aim.task,
            exact=recording.exact_torque(self.law),
            at_limit=recording.at_limit(self.dynamics.limits_rad),
            rasters={axis: sim.data[probe] != 0 for axis, probe in closed.probes.items()},
            sim=sim,
            wall_s=wall_s,
        )

    # results

    def probes(self, run: ArmRun) -> xr.Dataset:
        """Return the series at every physics step, and the spikes of M1 one by one."""
        return dataset(run)

    def scenes(self, run: ArmRun) -> Scenes:
        """Return a scene of the robot at the end, with the hand's target and trace."""
        return Scenes(self._marks(run.recording))

    def _marks(self, recording: ArmRecording) -> Marks:
        """Mark the target, and at most every second place of the hand's recent trace."""

        def marks(end: int) -> list[Mark]:
            now_s = recording.time_s[end - 1]
            trace = recording.hand[:end][recording.time_s[:end] >= self.trace_since(now_s)]
            # MuJoCo's scene has room for a limited number of shapes.
            thinned = trace[:: 2 + len(trace) // TRACE_MARKS]
            target = Mark(tuple(recording.target[end - 1]), 0.025, TARGET_RGBA)
            return [target, *(Mark(tuple(hand), 0.004, TRACE_RGBA) for hand in thinned)]

        return marks
