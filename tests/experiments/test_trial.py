"""A robot, its ports and the loop that joins them."""

import re

import numpy as np
import pytest

from spikeport.backends.board.link import LinkOptions
from spikeport.errors import UsageError
from spikeport.experiments.loop import Port
from spikeport.experiments.options import Options
from spikeport.experiments.trial import Rig
from spikeport.experiments.walk.trial import WalkSettings, WalkTrial
from spikeport.robot.link.connection import RobotOptions
from spikeport.robot.plant import Plant


class Push(Port):
    """Port that remembers the values it drives the robot with."""

    size_in, size_out = 1, 1

    def __init__(self):
        self.driven = []

    def observe(self):
        return np.array([7.0])

    def drive(self, values):
        self.driven.append(values.tolist())


def test_a_rig_films_every_step_that_its_ports_drive():
    plant, push = Plant(), Push()
    rig = Rig(plant, [push], 0.005)
    rig.loop.begin()
    rig.loop.step(np.array([3.0]))
    rig.loop.step(np.array([4.0]))
    assert push.driven == [[3.0], [4.0]]
    assert len(rig.film.poses) == 2


@pytest.mark.parametrize(
    ("robot", "real_time", "refused"),
    [("dds:lo:0", False, True), ("dds:lo:0", True, False), ("dds:lo:1", False, False)],
)
def test_a_robot_that_may_be_real_is_never_without_commands_while_a_board_is_waited_for(
    robot, real_time, refused
):
    asked = RobotOptions(robot, real_time=True, may_move_a_robot=True)
    link = LinkOptions(real_time=real_time)
    trial = WalkTrial(WalkSettings(), Options(1.0, backend="board", link=link, robot=asked))
    if not refused:
        assert trial.plant().link is None
        return
    with pytest.raises(UsageError, match=r"waits up to 10 s for each answer.*cure: --real-time"):
        trial.plant()


@pytest.mark.parametrize(
    ("seconds", "real_time", "refused"),
    [(10.0, True, True), (9.9, True, False), (20, False, False)],
)
def test_counts_are_not_written_while_a_robot_in_real_time_waits(
    tmp_path, seconds, real_time, refused
):
    options = Options(seconds, counts=tmp_path, robot=RobotOptions("stub", real_time=real_time))
    trial = WalkTrial(WalkSettings(), options)
    if not refused:
        assert trial.plant().link is None
        return
    with pytest.raises(UsageError, match=r"--counts: writes 10,000 steps .*--seconds below 10"):
        trial.plant()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"appearance": "wood"}, "unknown appearance 'wood'; choose from: menagerie, primitive"),
        ({"payload": -10.0, "mass": 0.1}, "payload=-10: the torso weighs 1.8 kg with mass=0.1, "),
    ],
)
def test_a_robot_that_cannot_be_made_is_refused_before_a_run(settings, message):
    with pytest.raises(UsageError, match=re.escape(message)):
        WalkTrial(WalkSettings(**settings), Options(4.0)).check()
    WalkTrial(WalkSettings(payload=-10.0), Options(4.0)).check()


def test_a_robot_behind_its_interface_is_not_perturbed():
    robot = RobotOptions("inline")
    assert WalkTrial(WalkSettings(), Options(1.0, robot=robot)).plant().link is None
    trial = WalkTrial(WalkSettings(payload=2.0, friction=0.5), Options(1.0, robot=robot))
    with pytest.raises(UsageError) as caught:
        trial.plant()
    assert str(caught.value) == (
        "friction=0.5, payload=2.0: perturbs the simulation in this process, and not a robot "
        "behind its interface; cure: leave out --robot, which has --robot-fault and --estimator "
        "of its own"
    )
