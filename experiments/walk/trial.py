"""The H1 walks a path on spiking neurons (paper, sec. 4.2 and Fig. 5)."""

from collections.abc import Sequence
from functools import cached_property

import nengo
import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from spikeport.cache import Arrays
from spikeport.constants import DT_S
from spikeport.errors import UsageError
from spikeport.experiments.calibration import DecoderCalibration
from spikeport.experiments.options import BACKENDS, Experiment
from spikeport.experiments.pictures import Scenes
from spikeport.experiments.policy.calibration import Walks
from spikeport.experiments.policy.readout import calibrated
from spikeport.experiments.policy.settings import EXACT, GAITS, OF_NEURONS, SPIKING
from spikeport.experiments.policy.trial import LegsTrial
from spikeport.experiments.run_folder import Result
from spikeport.experiments.trial import WITHOUT_NEURONS_UNUSED, ClosedLoop, needs
from spikeport.experiments.walk.approach import TURN_FIRST, TurnFirst
from spikeport.experiments.walk.controller import (
    analytic_policy,
    silence_ensembles,
    walk_controller,
)
from spikeport.experiments.walk.figure import walk_figure
from spikeport.experiments.walk.gait import encoding, record_gait, walks
from spikeport.experiments.walk.legs import OBSERVATION_DT_S
from spikeport.experiments.walk.marks import walk_marks
from spikeport.experiments.walk.metrics import metrics
from spikeport.experiments.walk.paths import WalkPath, find_path
from spikeport.experiments.walk.port import LEAD_S, WalkRig
from spikeport.experiments.walk.recording import WalkRun, dataset
from spikeport.experiments.walk.settings import WalkSettings
from spikeport.experiments.walk.silence_figure import silence_figure
from spikeport.networks.path_follower import FollowerNetwork, analytic_follower, path_follower
from spikeport.networks.path_following import FollowerGains
from spikeport.networks.policy import PolicyNetwork, policy, record_ranges
from spikeport.networks.region import Box
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.robot.plant import Plant
from spikeport.robot.terrain import check_reach
from spikeport.robot.walk_interface import CONTROL_DT_S
from spikeport.simulator import Simulator


class WalkTrial(LegsTrial[WalkRig, WalkRun]):
    """A walking run."""

    name = "walk"
    settings: WalkSettings

    @property
    def recorded(self) -> dict[str, object]:
        """Everything that the recorded gait depends on, besides the policy."""
        return {"experiment": self.name, "gait": self.settings.gait}

    @property
    def exact_policy(self) -> bool:
        """True if the policy is computed without neurons."""
        return not self.options.has_neurons or self.settings.policy == EXACT

    @property
    def exact_follower(self) -> bool:
        """True if the path follower is computed without neurons."""
        return not self.options.has_neurons or self.settings.follower == "exact"

    @cached_property
    def path(self) -> WalkPath:
        """The path, for as long as the run takes; a user's file is read once.

        Raises
        ------
        UsageError
            If there is no path of that name, or the robot cannot follow it.
        """
        settings = self.settings
        seconds = self.options.seconds + LEAD_S
        return find_path(settings.path, settings.speed, seconds, settings.ramp)

    def check(self) -> None:
        """Refuse a path, policy or calibration that does not fit, and silence without neurons."""
        check_reach(self.settings.terrain, self.path.farthest_m(self.options.seconds))
        if self.exact_policy and self.settings.silence:
            raise UsageError(f"silence={self.settings.silence:g}: the exact policy has no neurons")
        self._check_silence()
        super().check()

    @property
    def unused(self) -> dict[str, str]:
        """The settings that do nothing in this run, each with the reason and a cure."""
        found = super().unused
        if not self.settings.silence:
            found["silence_at"] = needs("silence")
        if not self.options.has_neurons:
            found["follower"] = WITHOUT_NEURONS_UNUSED
        elif self.exact_policy:
            why = f"with policy={EXACT}, which has no neurons; cure: policy={SPIKING}"
            found |= dict.fromkeys(OF_NEURONS, why)
        return found

    def _check_silence(self) -> None:
        """Refuse a silence that would begin after the end of the run."""
        settings, seconds = self.settings, self.options.seconds
        if settings.silence and settings.silence_at >= seconds:
            raise UsageError(
                f"silence={settings.silence:g}: begins at silence_at={settings.silence_at:g} s, "
                f"and the run ends at {seconds:g} s; cure: an earlier silence_at, or more --seconds"
            )

    def calibrate(self) -> DecoderCalibration:
        """Fit the policy to its neurons' spikes on the backend; UsageError without neurons."""
        if self.exact_policy:
            raise UsageError(f"policy={EXACT}: has no neurons to calibrate; cure: leave it out")
        return super().calibrate()

    def gait_and_walks(self) -> tuple[np.ndarray, Walks]:
        """Return the gait of the exact policy, and the walks that calibrate neurons."""
        return self._gait(self.walking_policy), walks(GAITS[self.settings.gait])

    def close_loop(self, plant: Plant) -> ClosedLoop[WalkRig]:
        """Build follower and policy in closed loop with the robot.

        Raises
        ------
        UsageError
            If the path cannot be followed, the policy is for another robot or has no neurons to
            silence, or its calibration was made for another policy or other settings.
        """
        settings = self.settings
        self.check()
        exact = self.walking_policy
        if self.exact_policy:
            # An exact policy observes as often as in training, a spiking one four times as often.
            walker = analytic_policy(exact)
            rig = WalkRig(plant, None, CONTROL_DT_S, DT_S, self._approach())
        else:
            walker, box = self.spiking_policy()
            rig = WalkRig(plant, box, OBSERVATION_DT_S, DT_S, self._approach())
        controller = walk_controller(self._follower(exact.gains), walker, settings.network_seed)
        spikes = silence_ensembles(controller, walker, settings) if settings.silence else ()
        with nengo.Network(label=self.name, seed=settings.network_seed) as network:
            network.add(controller)
            rig.loop.connect(
                [controller.observation, controller.reference, controller.state],
                [controller.action, controller.command],
            )
        return ClosedLoop(network, rig, {f"neuron {i}": probe for i, probe in enumerate(spikes)})

    def _approach(self) -> TurnFirst | None:
        return TurnFirst() if self.settings.law == TURN_FIRST else None

    def _gait(self, exact: WalkingPolicy) -> np.ndarray:
        """Return (n, 69) observations of the exact policy."""

        def record() -> Arrays:
            self.options.progress("recording the gait of the exact policy", None)
            return {"gait": record_gait(exact, GAITS[self.settings.gait])}

        return self.options.cache.kept("gait", (self.recorded, exact), record)["gait"]

    def spiking_policy(self) -> tuple[PolicyNetwork, Box]:
        """Convert the policy for the observations of its gait, and return it with its encoding.

        Raises
        ------
        UsageError
            If the policy is for another robot, or its calibration was made for another policy or
            other settings.
        """
        settings, exact = self.settings, self.walking_policy
        layers, (gait, walking) = exact.layers, self.gait_and_walks()
        ranges = record_ranges(layers, gait)
        self.options.progress("building the controller", None)
        found, seed = calibrated(self, layers, ranges, gait, walking), settings.network_seed
        network = policy(layers, ranges, settings.policy_options, seed, found, gait)
        return network, encoding(gait)

    def _follower(self, gains: FollowerGains) -> FollowerNetwork:
        if self.exact_follower:
            return analytic_follower(gains)
        return path_follower(gains, seed=self.settings.network_seed)

    def begin(self, rig: WalkRig) -> None:
        """Put the robot where the path begins."""
        rig.begin(self.options.seed, self.path)

    def record(self, closed: ClosedLoop[WalkRig], sim: Simulator, wall_s: float) -> WalkRun:
        """Return the recording, up to a fall, with the spikes that are kept."""
        walk, kept = closed.rig.walk, [sim.data[probe] != 0 for probe in closed.probes.values()]
        return WalkRun(
            path=walk.path,
            seconds=self.options.seconds,
            recording=walk.recording(),
            fallen_at_s=walk.fallen_at_s,
            encoding=walk.encoding,
            sim=sim,
            wall_s=wall_s,
            spikes=np.hstack(kept) if kept else None,
            floor=closed.rig.plant.floor,
        )

    def metrics(self, run: WalkRun) -> dict[str, object]:
        """Return the figures of a run, see `spikeport.experiments.walk.metrics`."""
        return metrics(run)

    def probes(self, run: WalkRun) -> xr.Dataset:
        """Return the series at every physics step, and the spikes that are kept."""
        return dataset(run)

    def scenes(self, run: WalkRun) -> Scenes:
        """Return a scene of the robot at the end, with path and trace."""
        return Scenes(walk_marks(run), "track")

    def figure(self, run: WalkRun, pictures: Sequence[np.ndarray], result: Result) -> Figure:
        """Draw the paper's Fig. 5, or 5c where spikes are kept."""
        if run.spikes is not None:
            return silence_figure(run, run.spikes, result)
        return walk_figure(run, pictures, result)


EXPERIMENT = Experiment(
    trial=WalkTrial,
    settings=WalkSettings,
    backends=BACKENDS,
    seconds=40.0,
    shortest_s=0.02,
    pipeline="compact",
    of_run=("path", "speed", "ramp"),
)
