"""A robot, its ports and the loop that joins them."""

import numpy as np

from spikeport.experiments.loop import Port
from spikeport.experiments.trial import Rig
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
