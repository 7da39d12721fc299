"""A robot, its ports and the film that watches."""

import numpy as np

from spikeport.experiments.loop import Port
from spikeport.experiments.rig import Film, Rig
from spikeport.robot.plant import Plant


class Push(Port):
    """Sends one value to the robot, and remembers it."""

    size_in, size_out = 1, 1

    def __init__(self):
        self.driven = []

    def observe(self):
        return np.array([7.0])

    def drive(self, values):
        self.driven.append(values.tolist())


def test_a_film_keeps_a_copy_of_every_pose():
    plant = Plant()
    film = Film(plant)
    for height_m in (1.0, 2.0):
        plant.data.qpos[2] = height_m
        film.drive(np.empty(0))
    assert [pose[2] for pose in film.poses] == [1.0, 2.0]
    assert film.observe().shape == (0,)
    film.begin()
    assert film.poses == []


def test_a_rig_films_what_its_ports_do():
    plant, push = Plant(), Push()
    rig = Rig(plant, [push], 0.005)
    rig.loop.step(np.array([3.0]))
    rig.loop.step(np.array([4.0]))
    assert push.driven == [[3.0], [4.0]]
    assert len(rig.film.poses) == 2
