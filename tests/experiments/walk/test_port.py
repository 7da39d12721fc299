import nengo
import numpy as np
import pytest

from spikeport.experiments.walk.gait import clipped_shares, encoding, record_gait
from spikeport.experiments.walk.metrics import command_errors
from spikeport.experiments.walk.paths import find_path
from spikeport.experiments.walk.port import LEAD_S, WalkRig
from spikeport.networks import walking_policy
from spikeport.networks.region import Box
from spikeport.robot import mirror
from spikeport.robot.engine import mujoco
from spikeport.robot.perturbation import Perturbation
from spikeport.robot.perturbed_plant import PerturbedPlant
from spikeport.robot.plant import Plant
from spikeport.robot.walk_interface import PARTS

LINE = find_path("line", 0.5, 10.0)
REST = np.zeros(21)
TURNED = (0.6, 0.0, 0.0, 0.8)


def begun(encoding=None, every_s=0.005, dt_s=0.005, plant=None):
    rig = WalkRig(plant or Plant(), encoding, every_s, dt_s)
    rig.begin(0, LINE)
    return rig


class Elsewhere(Plant):
    """A robot that runs find at (3, 2) m, where it looks along y."""

    @property
    def start(self):
        return np.array([np.pi / 2, 3.0, 2.0])


def test_the_path_of_a_robot_that_is_there_already_begins_where_it_stands():
    """It would turn, and walk back or aside, on a path along the x axis of its IMU."""
    reference = begun(plant=Elsewhere()).walk.inputs[1]
    assert reference == pytest.approx([3.0, 2.0 + 0.5 * LEAD_S, 0.0, 0.5])
    assert begun().walk.inputs[1].tolist() == LINE.at(LEAD_S).tolist()


class InTheAir(Plant):
    """A robot that is in the air, and turned about its vertical, wherever an estimator finds it."""

    @property
    def true_data(self):
        data = mujoco.MjData(self.model)
        data.qpos[2:7] = 3.0, *TURNED
        mujoco.mj_fwdPosition(self.model, data)
        return data


def test_contacts_and_tilt_are_recorded_as_they_are_and_not_as_they_are_estimated():
    on_its_feet, in_the_air = (shaken(plant=plant) for plant in (Plant(), InTheAir()))
    assert on_its_feet.on_floor.any()
    assert not in_the_air.on_floor.any()
    assert (in_the_air.quaternion == TURNED).all()
    assert (in_the_air.state == on_its_feet.state).all()


def test_physics_runs_at_200_hz():
    rig = begun(dt_s=0.001)
    for _ in range(12):
        rig.loop.step(REST)
    assert rig.walk.recording().time_s.tolist() == [0.0, 0.005]
    assert len(rig.film.poses) == 2


def test_the_reference_runs_ahead_by_its_lead_and_the_state_is_the_robots():
    rig = begun()
    rig.loop.step(REST)
    _, reference, state = rig.walk.inputs
    assert reference == pytest.approx([0.5 * (LEAD_S + 0.005), 0, 0.5, 0])
    x, y = rig.plant.data.qpos[:2]
    assert state == pytest.approx([0, x, y, *rig.plant.data.qvel[:2]], abs=1e-3)


def test_values_out_of_range_are_clipped_and_counted():
    box = Box(np.zeros(69), np.full(69, 1e-4))
    rig = begun(box)
    shown = rig.loop.step(np.concatenate((np.zeros(19), (0.4, -0.3))))
    rig.loop.step(REST)
    assert shown[PARTS["command"]] == pytest.approx([1e-4, 0.0, -1e-4])
    seen = rig.walk.recording().observation
    assert seen[1, PARTS["command"]].tolist() == [0.005, 0.0, -0.01]
    shares = clipped_shares(seen, box)
    assert list(shares) == list(PARTS)
    assert shares["command"] == pytest.approx(2 / 6)
    assert shares["last action"] == 0


def test_the_nodes_of_a_controller_are_connected_to_the_port():
    with nengo.Network() as network:
        observation, reference, state = (nengo.Node(size_in=size) for size in (69, 4, 5))
        action, command = nengo.Node(np.full(19, 0.1)), nengo.Node([0.4, -0.3])
        rig = begun(dt_s=0.001)
        rig.loop.connect([observation, reference, state], [action, command])
        probe = nengo.Probe(reference)
    with nengo.Simulator(network, progress_bar=False) as sim:
        sim.run_steps(10)
    recording = rig.walk.recording()
    assert recording.action[-1].tolist() == [0.1] * 19
    assert recording.command[-1].tolist() == [0.4, -0.3]
    assert sim.data[probe][-1] == pytest.approx(LINE.at(LEAD_S + 0.01), abs=1e-6)


def test_a_recorded_gait_lies_in_its_encoding():
    gait = record_gait(walking_policy.load(), seconds=3.0)
    assert gait.shape == (1200, 69)
    assert np.array_equal(gait[600:], mirror.OBSERVATION(gait[:600]))
    assert np.array_equal(gait[:50], record_gait(walking_policy.load(), seconds=0.25)[:50])
    box = encoding(gait)
    assert max(clipped_shares(gait, box).values()) < 0.005
    assert box.restore(np.ones(69))[PARTS["command"]] == pytest.approx([1, 0.02, 1])


def shaken(**asked):
    """Return the record of a robot whose limbs are thrown to and fro."""
    rig = begun(**asked)
    for action in np.random.RandomState(1).uniform(-1, 1, (40, 19)):
        rig.loop.step(np.append(action, (0.0, 0.1)))
    return rig.walk.recording()


def test_the_recorded_yaw_rate_is_free_of_sensor_noise():
    bad, good = (
        shaken(plant=plant) for plant in (PerturbedPlant(Perturbation(sensor_noise=1.0)), Plant())
    )
    sensed = bad.observation[:, PARTS["angular velocity"]]
    assert np.abs(sensed - good.observation[:, PARTS["angular velocity"]]).max() > 0.1
    assert bad.yaw_rate_rad_s.tolist() == good.yaw_rate_rad_s.tolist()
    assert np.abs(good.yaw_rate_rad_s).max() > 0.01
    assert command_errors(bad).tolist() == command_errors(good).tolist()


@pytest.mark.parametrize("every_s", [0.005, 0.02])
def test_the_recorded_yaw_rate_equals_the_observed_one_without_sensor_noise(every_s):
    """They agree bit for bit: figures equal those of earlier runs, made of the observed one."""
    recording = shaken(every_s=every_s)
    down, omega = (recording.observation[:, PARTS[k]] for k in ("gravity", "angular velocity"))
    assert recording.yaw_rate_rad_s.tolist() == (-np.einsum("nd,nd->n", down, omega)).tolist()
