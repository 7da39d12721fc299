import dataclasses

import nengo
import numpy as np
import pytest

from spikeport.errors import DivergedError, UsageError
from spikeport.experiments.arm.port import ArmRig
from spikeport.experiments.arm.reach import ReachSettings, ReachTrial
from spikeport.experiments.arm.reach_task import BOXES, ReachTask, TargetBox, rehearsals
from spikeport.experiments.arm.recording import ArmRecording
from spikeport.experiments.arm.region import record_region
from spikeport.experiments.options import Options
from spikeport.networks.arm import ArmSizes, analytic_arm, arm
from spikeport.robot.description import ARM_JOINTS
from spikeport.robot.plant import Plant

SMALL = ArmSizes(m1=60, cb=30, s1=10)


@pytest.fixture(scope="module")
def region(law):
    return record_region(law, rehearsals(BOXES["small"]))


def started(law, seed=0, dt_s=0.001):
    rig = ArmRig(Plant(anchored=True), law, dt_s)
    rig.begin(seed, lambda hand: ReachTask(BOXES["small"], seed, hand))
    return rig


def simulate(law, rig, seconds, controller=analytic_arm, change=lambda net: None):
    """Run a controller of the law in the loop, and return its torques."""
    with nengo.Network(seed=0) as net:
        network = controller(law)
        rig.loop.connect([network.state, network.target], [network.torque])
        torque = nengo.Probe(network.torque)
    change(net)
    # Nengo's optimiser adds in an order that differs from one simulator to the next.
    with nengo.Simulator(net, seed=0, progress_bar=False, optimize=False) as sim:
        sim.run(seconds)
    return sim.data[torque]


def test_the_plant_takes_the_torque_of_every_fifth_step_of_the_controller(law):
    rig = started(law)
    torques = np.arange(48.0).reshape(12, 4)
    for torque in torques:
        rig.loop.step(torque)
    assert rig.port.recording().torque.tolist() == [torques[4].tolist(), torques[9].tolist()]
    assert rig.plant.time_s == pytest.approx(0.010)


def test_the_plant_applies_the_torque_it_was_given(law):
    rig = started(law)
    given = np.array([1.0, -2.0, 0.5, 0.25])
    for _ in range(5):
        rig.loop.step(given)
    command = rig.plant.data.ctrl[[rig.plant.joints.index(joint) for joint in ARM_JOINTS]]
    assert command.tolist() == given.tolist()


def test_without_a_time_step_every_step_of_the_controller_is_a_physics_step(law):
    rig = started(law, dt_s=None)
    rig.loop.step(np.zeros(4))
    assert len(rig.port.recording().time_s) == len(rig.film.poses) == 1


def test_observations_change_only_in_physics_steps(law):
    rig = started(law)
    seen = [rig.loop.step(rig.port.exact_torque(law)) for _ in range(11)]
    changes = [i for i in range(1, 11) if not np.array_equal(seen[i], seen[i - 1])]
    assert changes == [4, 9]
    assert seen[0].shape == (14,)


def test_a_sample_holds_the_observation_that_the_torque_answers(law):
    rig = started(law)
    before = rig.loop.step(np.zeros(4))
    for _ in range(4):
        rig.loop.step(np.zeros(4))
    run = rig.port.recording()
    assert np.array_equal(np.hstack([run.q, run.dq, run.hand, run.target])[0], before)
    assert run.time_s.tolist() == [0.0]


def test_the_exact_torques_of_a_run_are_those_the_law_gave(law):
    rig = started(law, dt_s=None)
    given = []
    for _ in range(20):
        given.append(rig.port.exact_torque(law))
        rig.loop.step(given[-1])
    assert rig.port.recording().exact_torque(law) == pytest.approx(np.array(given), abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["analytic", "spiking"])
def test_two_runs_are_equal_bit_for_bit(law, region, kind):
    def controller(law):
        return analytic_arm(law) if kind == "analytic" else arm(law, region, SMALL)

    def run():
        rig = started(law)
        torque = simulate(law, rig, 0.3, controller)
        return torque, np.hstack(rig.port.recording().columns[1:]), rig.film.poses

    for first, second in zip(run(), run(), strict=True):
        assert np.array_equal(first, second)


def test_runs_with_different_seeds_differ(law):
    assert not np.array_equal(
        simulate(law, started(law, seed=0), 0.05), simulate(law, started(law, seed=1), 0.05)
    )


@pytest.mark.slow
def test_the_plants_state_reaches_the_controller_by_connections_only(law, region):
    def cut(net):
        for connection in list(net.connections):
            if connection.pre_obj.label == "plant":
                net.connections.remove(connection)

    def torques(seed, change):
        return simulate(law, started(law, seed), 0.05, lambda law: arm(law, region, SMALL), change)

    assert np.array_equal(torques(0, cut), torques(1, cut))
    assert not np.array_equal(torques(0, lambda net: None), torques(1, lambda net: None))


def test_a_torque_that_is_not_finite_is_reported_as_divergence(law):
    rig = started(law, dt_s=None)
    with pytest.raises(DivergedError) as caught:
        rig.loop.step(np.array([0.0, np.nan, 0.0, np.inf]))
    assert str(caught.value) == (
        "the controller's torque in N m is not finite at 0.000 s: value 1 of 4, counted from 0, is "
        "nan; cure: look at its inputs in the last states"
    )


def test_a_plant_out_of_range_is_reported_as_divergence(law):
    rig = started(law, dt_s=None)
    rig.plant.data.qvel[-1] = 1e4
    with pytest.raises(DivergedError, match=r"^the simulation diverged at 0\.005 s: "):
        rig.loop.step(np.zeros(4))


def test_a_huge_torque_is_clipped_by_the_robot(law):
    rig = started(law, dt_s=None)
    for _ in range(100):
        rig.loop.step(np.array([1e9, -1e9, 1e9, -1e9]))
    assert np.abs(rig.plant.data.actuator_force).max() <= 300
    assert len(rig.film.poses) == 100


def test_the_region_contains_the_states_that_the_exact_law_visits(law, region):
    rig = started(law, seed=7, dt_s=None)
    for _ in range(1000):
        rig.loop.step(rig.port.exact_torque(law))
    run = rig.port.recording()
    assert (np.abs(region.q.normalise(run.q)) < 1).mean() > 0.99
    assert (np.abs(region.x.normalise(run.hand)) < 1).mean() > 0.99


def test_every_target_of_the_box_lies_in_the_region(region):
    box: TargetBox = BOXES["small"]
    assert (np.abs(region.x.normalise(box.grid(2))) < 1).all()


def test_the_error_of_an_unknown_appearance_lists_the_appearances():
    with pytest.raises(UsageError) as caught:
        ReachTrial(ReachSettings(appearance="chrome"), Options(1.0)).plant()
    assert str(caught.value) == "unknown appearance 'chrome'; choose from: menagerie, primitive"


def test_a_step_is_at_a_limit_if_one_joint_is_there_or_beyond(law):
    limits = law.arm.limits_rad
    inside, low, high, beyond = (limits.mean(axis=1) for _ in range(4))
    low[0], high[3], beyond[1] = limits[0, 0], limits[3, 1], limits[1, 1] + 0.01
    q = np.array([inside, low, high, beyond])
    recording = dataclasses.replace(ArmRecording(*[np.zeros(4)] * 6), q=q)
    assert recording.at_limit(limits).tolist() == [False, True, True, True]


def test_the_joint_limits_of_the_law_are_those_of_the_robot(law):
    model = Plant().model
    limits = [model.joint(joint).range for joint in ARM_JOINTS]
    assert np.array_equal(limits, law.arm.limits_rad)
