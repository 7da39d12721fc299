"""One spiking humanoid walks, draws, retracts its arm and walks on (paper, sec. 4.3, Fig. 1, 6)."""

import dataclasses
import hashlib
from collections.abc import Sequence
from functools import cached_property

import nengo
import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from spikeport.cache import Arrays
from spikeport.constants import DT_S
from spikeport.errors import UsageError
from spikeport.experiments.options import BACKENDS, Experiment, Options
from spikeport.experiments.pictures import Scenes
from spikeport.experiments.policy.calibration import Walks
from spikeport.experiments.policy.readout import calibrated
from spikeport.experiments.policy.settings import GAITS
from spikeport.experiments.policy.trial import LegsTrial
from spikeport.experiments.run_folder import Result
from spikeport.experiments.switch.controller import analytic_humanoid, spiking_humanoid
from spikeport.experiments.switch.figure import switch_figure
from spikeport.experiments.switch.gate import HumanoidRig
from spikeport.experiments.switch.goals import Goal, find_goals
from spikeport.experiments.switch.metrics import metrics
from spikeport.experiments.switch.picture import middles, switch_captions, switch_marks
from spikeport.experiments.switch.recording import SwitchRun, dataset
from spikeport.experiments.switch.rehearsal import ExactControllers, Rehearsals, Rehearsed
from spikeport.experiments.switch.settings import SwitchSettings
from spikeport.experiments.trial import WITHOUT_NEURONS_UNUSED, ClosedLoop
from spikeport.experiments.walk.gait import encoding
from spikeport.experiments.walk.legs import OBSERVATION_DT_S
from spikeport.experiments.walk.path_file import path_files
from spikeport.networks.humanoid import HumanoidNetwork
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.networks.policy import record_ranges, solved_layers
from spikeport.networks.region import Box
from spikeport.robot.arm import ArmDynamics
from spikeport.robot.plant import Plant
from spikeport.robot.terrain import check_reach
from spikeport.robot.walk_interface import CONTROL_DT_S
from spikeport.simulator import Simulator

LONGEST_S = 60.0
"""The longest schedule if no time is asked for; a run ends with its schedule."""
GATES = "gates"


class SwitchTrial(LegsTrial[HumanoidRig, SwitchRun]):
    """A switching run, which ends with the last phase of its schedule.

    Raises
    ------
    UsageError
        If the schedule is invalid, or longer than the run.
    """

    name = "switch"
    settings: SwitchSettings

    def __init__(self, settings: SwitchSettings, options: Options) -> None:
        self.schedule = settings.load_schedule(options.seconds)
        super().__init__(settings, dataclasses.replace(options, seconds=self.schedule.end_s))

    @property
    def recorded(self) -> dict[str, object]:
        """Everything that the rehearsals depend on, besides the policy."""
        digest = hashlib.sha256(self.schedule.model_dump_json().encode())
        for goal in self.own_goals:
            if goal.path is not None and path_files(str(goal.phase.path)):
                # A user's file may change under the same name.
                digest.update(goal.path.points.tobytes())
        # Settings that change the recordings of the exact controllers; numbers of neurons do not.
        names = ("digit", "anchor", "gait")
        chosen = {name: getattr(self.settings, name) for name in names}
        # A policy's digest covers its weights alone.
        gains = self.walking_policy.gains
        return {
            "experiment": self.name,
            "schedule": digest.hexdigest()[:12],
            "follower_gains": [gains.kp_speed, gains.kp_heading],
            **chosen,
        }

    @cached_property
    def own_goals(self) -> list[Goal]:
        """The goals of the run itself; a user's paths are read once."""
        return self.goals(self.options.seed)

    def goals(self, seed: int) -> list[Goal]:
        """Return the goals of all phases; raises UsageError if a path cannot be followed."""
        try:
            return find_goals(self.schedule, self.settings.digit, seed)
        except UsageError as error:
            raise UsageError(f"{self.settings.schedule_file}: {error}") from None

    def check(self) -> None:
        """Refuse a schedule, policy or calibration that does not fit."""
        if self.options.robot is not None and self.settings.anchor:
            raise UsageError(
                "anchor=true: holds the walking robot by its pelvis to draw, which a robot's "
                "interface cannot do; give --set anchor=false --set schedule=free-standing"
            )
        if self.settings.selection == "spa" and self.options.backend != "reference":
            raise UsageError(
                f"selection=spa: neurons have one filter on backend '{self.options.backend}', but "
                "nengo_spa's GPi and GPe need two (AMPA 2 ms, GABA 8 ms); leave it out, or give "
                "--backend reference"
            )
        paths = [(goal.path, goal.phase) for goal in self.own_goals]
        # A path goes on from where the last one ended, in whatever direction.
        ways_m = [path.farthest_m(phase.seconds) for path, phase in paths if path is not None]
        check_reach(self.settings.terrain, sum(ways_m))
        super().check()

    @property
    def unused(self) -> dict[str, str]:
        """The settings that do nothing in this run, each with the reason and a cure."""
        found = super().unused
        if all(phase.arm != "digit" for phase in self.schedule.phases):
            found["digit"] = 'in a schedule that draws none; cure: a phase with arm = "digit"'
        if not self.options.has_neurons:
            found |= dict.fromkeys(("preset", "selection"), WITHOUT_NEURONS_UNUSED)
            if self.settings.selection == "spa":
                found["selection"] = "without neurons; cure: --backend reference, for float ones"
        return found

    # the controller

    def exact(self) -> ExactControllers:
        """Return the exact controllers; raises UsageError if the policy is for another robot."""
        law = OperationalSpaceLaw(ArmDynamics())
        return ExactControllers(law, self.walking_policy)

    def rehearsals(self, exact: ExactControllers) -> Rehearsals:
        """Return the rehearsals of the schedule by the exact controllers, before they are run."""
        settings = self.settings
        return Rehearsals(
            exact, settings.anchor, self.goals, settings.schedule_file, GAITS[settings.gait]
        )

    def gait_and_walks(self) -> tuple[np.ndarray, Walks]:
        """Return the observations of the rehearsals, and the walks that calibrate neurons."""
        rehearsals = self.rehearsals(self.exact())
        return self._rehearsed(rehearsals).observations, rehearsals.walks

    def _rehearsed(self, rehearsals: Rehearsals) -> Rehearsed:
        def rehearse() -> Arrays:
            self.options.progress("rehearsing with the exact controllers", None)
            return rehearsals.record().arrays()

        inputs = (self.recorded, rehearsals.exact.policy)
        return Rehearsed.of(self.options.cache.kept("rehearsal", inputs, rehearse))

    def _spiking(self, exact: ExactControllers) -> tuple[HumanoidNetwork, Box]:
        """Build the humanoid for the states of the rehearsals, and return it with its encoding."""
        settings, rehearsals = self.settings, self.rehearsals(exact)
        rehearsed = self._rehearsed(rehearsals)
        layers, gait = exact.policy.layers, rehearsed.observations
        ranges, options = record_ranges(layers, gait), settings.policy_options
        # made first, since solving layers and calibrating a policy build networks of their own
        solved = solved_layers(layers, ranges, options, settings.network_seed, gait)
        found = calibrated(self, layers, ranges, gait, rehearsals.walks)
        self.options.progress("building the controller", None)
        # A calibration changes the first and the last layer; hidden ones stay as they were solved.
        of = found.of(solved) if found else solved
        return spiking_humanoid(settings, exact, rehearsed.region, of, ranges), encoding(gait)

    # the run

    def close_loop(self, plant: Plant) -> ClosedLoop[HumanoidRig]:
        """Build the humanoid in closed loop with the robot.

        Raises
        ------
        UsageError
            If a path of the schedule cannot be followed, the policy is for another robot, or its
            calibration was made for another policy or other settings.
        """
        settings, box, every_s = self.settings, None, CONTROL_DT_S
        self.check()
        exact = self.exact()
        if not self.options.has_neurons:
            controller = analytic_humanoid(exact, balances=not settings.anchor)
        else:
            controller, box = self._spiking(exact)
            every_s = OBSERVATION_DT_S
        rig = HumanoidRig(plant, settings.anchor, box, every_s, DT_S)
        with nengo.Network(label=self.name, seed=settings.network_seed) as network:
            network.add(controller)
            _connect(controller, rig)
            probes = {GATES: nengo.Probe(controller.gates), **_probes(controller)}
        return ClosedLoop(network, rig, probes)

    def begin(self, rig: HumanoidRig) -> None:
        """Put the robot where the first phase begins."""
        rig.begin(self.options.seed, self.own_goals)

    def record(self, closed: ClosedLoop[HumanoidRig], sim: Simulator, wall_s: float) -> SwitchRun:
        """Return the recordings, up to a fall, with gates and spikes of the basal ganglia."""
        rig, work = closed.rig, closed.rig.gate.recording()
        return SwitchRun(
            goals=rig.gate.goals,
            paths=rig.gate.paths,
            recording=rig.walk.recording(),
            arm=rig.arm.recording(),
            local_m=work.local_m,
            hands_m=work.hands_m,
            gates=sim.data[closed.probes[GATES]],
            spikes={
                # Nengo probes spikes as 1/dt: a truth value takes an eighth of the memory.
                name: sim.data[probe] != 0
                for name, probe in closed.probes.items()
                if name != GATES
            },
            fallen_at_s=rig.walk.fallen_at_s,
            anchored=self.settings.anchor,
            sim=sim,
            wall_s=wall_s,
            floor=rig.plant.floor,
        )

    # results

    def metrics(self, run: SwitchRun) -> dict[str, object]:
        """Return the figures of a run, see `spikeport.experiments.switch.metrics`."""
        return metrics(run)

    def probes(self, run: SwitchRun) -> xr.Dataset:
        """Return the series at every physics step, with gates and spikes."""
        return dataset(run)

    def scenes(self, run: SwitchRun) -> Scenes:
        """Return scenes in the middle of each phase, with paths, drawing and names of phases."""
        return Scenes(switch_marks(run), "track", switch_captions(run), middles(run))

    def figure(self, run: SwitchRun, pictures: Sequence[np.ndarray], result: Result) -> Figure:
        """Draw the paper's Figs. 1 and 6."""
        return switch_figure(run, pictures, result)


def _connect(net: HumanoidNetwork, rig: HumanoidRig) -> None:
    walk, arm = (net.observation, net.follower.reference, net.follower.state), net.arm
    rig.loop.connect(
        [*walk, arm.state, arm.target, net.utilities],
        [net.action, net.command, net.torque, net.gates],
    )


def _probes(net: HumanoidNetwork) -> dict[str, nengo.Probe]:
    """Probe all neurons of each nucleus."""
    nuclei = net.selection.nuclei
    # The populations of a nucleus are views of one ensemble's neurons; these are probed whole.
    return {name: nengo.Probe(populations[0].obj) for name, populations in nuclei.items()}


EXPERIMENT = Experiment(
    trial=SwitchTrial,
    settings=SwitchSettings,
    backends=BACKENDS,
    seconds=LONGEST_S,
    shortest_s=0.02,
    pipeline="compact",
    lasts=SwitchSettings.lasts,
)
