"""One run of the humanoid in closed loop, from its settings to a written folder."""

from typing import Any, NamedTuple

import nengo
import numpy as np

from spikeport.experiments import closed_loop, run_folder
from spikeport.experiments.closed_loop import DT_S, open_simulator, simulate
from spikeport.experiments.options import Outcome
from spikeport.experiments.pictures import check_video, pictures, write_video
from spikeport.experiments.policy.readout import check_calibrated
from spikeport.experiments.switch.controller import analytic_humanoid, spiking_humanoid
from spikeport.experiments.switch.figure import switch_figure
from spikeport.experiments.switch.loop import SwitchLoop, close_loop
from spikeport.experiments.switch.metrics import metrics
from spikeport.experiments.switch.picture import CAMERA, middles, switch_captions, switch_marks
from spikeport.experiments.switch.probes import write_probes
from spikeport.experiments.switch.rehearsal import Exact
from spikeport.experiments.switch.trial import SwitchRun, SwitchTrial
from spikeport.experiments.walk.loop import OBSERVATION_DT_S
from spikeport.networks.humanoid import HumanoidNetwork
from spikeport.networks.region import Box
from spikeport.robot.walk_interface import CONTROL_DT_S
from spikeport.simulator import Simulator


class Closed(NamedTuple):
    """Plant and controller in one network, and its probes."""

    loop: SwitchLoop
    network: nengo.Network
    gates: nengo.Probe
    nuclei: dict[str, nengo.Probe]


class Rig(NamedTuple):
    """What was closed, in a simulator, ready for all runs that need the same network."""

    closed: Closed
    sim: Simulator


def run(trial: SwitchTrial) -> Outcome:
    """Run the experiment and write its folder."""
    options = trial.options
    rig = prepare(trial)
    with rig.sim as sim:
        done = perform(trial, rig)
    outcome = closed_loop.outcome(trial, sim, metrics(done))
    options.progress("writing", None)
    loop = rig.closed.loop
    shown = pictures(loop, switch_marks(done), middles(done), CAMERA)
    _write(trial, loop, done._replace(pictures=shown), outcome.result)
    return outcome


def prepare(trial: SwitchTrial) -> Rig:
    """Check what a trial asks for, build its network and compile it; raises as `closed`."""
    ready = closed(trial)
    return Rig(ready, open_simulator(ready.network, trial.options))


def closed(trial: SwitchTrial) -> Closed:
    """Check what a trial asks for, and build its network, robot and all.

    Raises
    ------
    UsageError
        If a path of its schedule cannot be followed, its policy is not for this robot, or its
        calibration was made for another.
    RenderError, MissingExtraError
        If it asks for a video that cannot be made here.
    """
    settings, options = trial.settings, trial.options
    trial.goals(options.seed)
    loop = _loop(trial, None)  # here an unknown appearance is told
    if options.video:
        check_video(options.folder, loop)
    controller, box = _controller(trial)
    loop = _loop(trial, box)
    with nengo.Network(label=trial.name, seed=settings.network_seed) as network:
        network.add(controller)
        close_loop(controller, loop)
        gates = nengo.Probe(controller.gates)
        nuclei = _probes(controller)
    return Closed(loop, network, gates, nuclei)


def _controller(trial: SwitchTrial) -> tuple[HumanoidNetwork, Box | None]:
    exact = Exact.of(trial.settings)
    if trial.analytic:
        return analytic_humanoid(exact, balances=not trial.settings.anchor), None
    check_calibrated(trial, exact.policy)
    return spiking_humanoid(trial, exact)


def _loop(trial: SwitchTrial, box: Box | None) -> SwitchLoop:
    settings, every_s = trial.settings, CONTROL_DT_S if trial.analytic else OBSERVATION_DT_S
    return SwitchLoop(settings.anchor, box, every_s, DT_S, settings.appearance)


def _probes(controller: HumanoidNetwork) -> dict[str, nengo.Probe]:
    """Of all neurons of each nucleus."""
    nuclei = controller.selection.nuclei
    return {name: nengo.Probe(populations[0].obj) for name, populations in nuclei.items()}


def perform(trial: SwitchTrial, rig: Rig) -> SwitchRun:
    """Run a trial on a rig that was prepared for it, or for one with the same network.

    Raises
    ------
    DivergedError
        If an action is not finite; the last states are in the folder.
    """
    (loop, _, gates, nuclei), sim = rig
    options = trial.options
    if sim.n_steps:
        sim.reset(options.seed)
    goals = trial.goals(options.seed)
    loop.start(options.seed, goals)
    wall_s = simulate(sim, loop.plant, options, lambda: loop.over)
    return SwitchRun(
        goals=goals,
        paths=loop.paths,
        recording=loop.recording(),
        arm=loop.arm_recording(),
        seen_m=np.array(loop.seen_m),
        hands_m=np.array(loop.hands_m),
        gates=sim.data[gates],
        spikes={name: sim.data[probe] != 0 for name, probe in nuclei.items()},
        fallen_at_s=loop.fallen_at_s,
        anchored=trial.settings.anchor,
        sim=sim,
        wall_s=wall_s,
    )


def _write(trial: SwitchTrial, loop: SwitchLoop, done: SwitchRun, result: dict[str, Any]) -> None:
    folder = trial.options.folder
    run_folder.clear(folder)
    write_probes(folder, done, DT_S)
    run_folder.write_figure(folder, switch_figure(done, result))
    if done.fallen_at_s is not None:
        run_folder.add_last_states(folder, loop.plant.history())
    if trial.options.video:
        write_video(folder, loop, switch_marks(done), CAMERA, switch_captions(done))
    run_folder.write_result(folder, result)
