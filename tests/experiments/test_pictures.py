"""Captions of pictures, and films of poses."""

import imageio_ffmpeg
import numpy as np
import pytest

from spikeport.experiments.pictures import BAR, Caption, Film, captioned, check_video, cores_of
from spikeport.robot.plant import Plant


def test_a_caption_is_a_bar_with_text_above_the_picture():
    frame = np.full((200, 300, 3), 7, np.uint8)
    written = captioned(frame, Caption("walk", "#00ff00"))
    assert (written[BAR:] == 7).all()
    assert written.shape == (200 + BAR, 300, 3)
    bar = written[:BAR]
    assert (bar[:, -20:] == [0, 255, 0]).all()
    assert (bar == 255).all(axis=2).any()
    assert (captioned(frame, Caption("", "#00ff00"))[:BAR] == [0, 255, 0]).all()


def test_an_encoder_that_fails_is_found_before_a_run(monkeypatch):
    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", lambda: "/bin/false")
    with pytest.raises(OSError, match="no video"):
        check_video(Plant())


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


def test_the_title_of_a_figure_has_the_cores_of_a_run():
    cores = [{"cores": {"used": used}} for used in (1, 2)]
    assert [cores_of({"resources": used}) for used in (None, *cores)] == [
        "",
        ", 1 core",
        ", 2 cores",
    ]
