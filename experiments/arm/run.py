"""One run of the arm in closed loop, from its settings to a written folder.

What its experiments share; each is an `ArmTrial` that says what to do, and what to make of it.
"""

from typing import Any, NamedTuple

import nengo

from spikeport.experiments import closed_loop, run_folder
from spikeport.experiments.arm.controller import spiking_controller
from spikeport.experiments.arm.loop import ArmLoop, close_loop
from spikeport.experiments.arm.picture import arm_marks
from spikeport.experiments.arm.probes import write_probes
from spikeport.experiments.arm.reachability import check_reachable
from spikeport.experiments.arm.trial import ArmRun, ArmTrial
from spikeport.experiments.closed_loop import DT_S, open_simulator, simulate
from spikeport.experiments.options import Outcome
from spikeport.experiments.pictures import check_video, picture, write_video
from spikeport.networks.arm import ArmNetwork, analytic_arm
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.robot.arm import ArmDynamics
from spikeport.simulator import Simulator


class Rig(NamedTuple):
    """Plant, controller and simulator, ready for all runs that need the same network."""

    loop: ArmLoop
    built: ArmNetwork
    sim: Simulator


def run(trial: ArmTrial) -> Outcome:
    """Run an experiment and write its folder."""
    options = trial.options
    rig = prepare(trial)
    with rig.sim as sim:
        done = perform(trial, rig)
    outcome = closed_loop.outcome(trial, sim, trial.metrics(done))
    options.progress("writing", None)
    marks = arm_marks(done.recording, trial.trace_since)
    _write(trial, rig.loop, done._replace(picture=picture(rig.loop, marks)), outcome.result)
    return outcome


def prepare(trial: ArmTrial) -> Rig:
    """Check what a trial asks for, build its network and compile it.

    Raises
    ------
    UsageError
        If a point of its goal is out of the arm's reach, or of the region of its network.
    RenderError, MissingExtraError
        If it asks for a video that cannot be made here.
    """
    settings, options = trial.settings, trial.options
    law = OperationalSpaceLaw(ArmDynamics())
    loop = ArmLoop(law, options.seed, DT_S, settings.appearance)
    if options.video:
        check_video(options.folder, loop)
    check_reachable(trial.goal, trial.goal_points())
    analytic = options.backend == "analytic"
    built = analytic_arm(law) if analytic else spiking_controller(trial, law)
    with nengo.Network(label=trial.name, seed=settings.network_seed) as network:
        network.add(built)
        close_loop(built, loop)
    return Rig(loop, built, open_simulator(network, options))


def perform(trial: ArmTrial, rig: Rig) -> ArmRun:
    """Run a trial on a rig that was prepared for it, or for one with the same network.

    Raises
    ------
    DivergedError
        If a torque is not finite; the last states are in the folder.
    """
    loop, sim = rig.loop, rig.sim
    if sim.n_steps:
        sim.reset(trial.options.seed)
    loop.restart(trial.options.seed)
    loop.begin(trial.task(loop.plant.hand_position()))
    wall_s = simulate(sim, loop.plant, trial.options)
    recording = loop.recording()
    return ArmRun(
        task=loop.task,
        recording=recording,
        exact=recording.exact_torque(loop.law),
        at_limit=recording.at_limit(loop.limits_rad),
        rasters={axis: sim.data[probe] != 0 for axis, probe in rig.built.rasters.items()},
        sim=sim,
        wall_s=wall_s,
    )


def _write(trial: ArmTrial, loop: ArmLoop, done: ArmRun, result: dict[str, Any]) -> None:
    folder = trial.options.folder
    run_folder.clear(folder)
    write_probes(folder, done.recording, done.exact, done.rasters, DT_S)
    run_folder.write_figure(folder, trial.figure(done, result))
    if trial.options.video:
        write_video(folder, loop, arm_marks(done.recording, trial.trace_since))
    run_folder.write_result(folder, result)
