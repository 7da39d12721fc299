import os
import subprocess
import sys

import numpy as np
import pytest

from spikeport.errors import RenderError, UsageError
from spikeport.robot import render
from spikeport.robot.perturbation import Perturbation
from spikeport.robot.perturbed_plant import PerturbedPlant
from spikeport.robot.plant import Plant
from spikeport.robot.render import Mark, Renderer


@pytest.fixture(scope="module")
def plant():
    return Plant(anchored=True)


@pytest.fixture(scope="module")
def renderer(plant):
    try:
        renderer = Renderer(plant.model, 320, 180)
    except RenderError as error:
        pytest.skip(str(error))
    yield renderer
    renderer.close()


def changed(one, other):
    """Return pixels that differ by more than a driver's rounding, ``(height, width)``."""
    return (np.abs(one.astype(int) - other) > 2).any(axis=2)


def test_a_frame_shows_the_robot(plant, renderer):
    frame = renderer.frame(plant.data)
    assert frame.shape == (180, 320, 3)
    assert frame.dtype == np.uint8
    dark = (frame.max(axis=2) < 80).mean()
    assert 0.05 < dark < 0.5
    assert frame[:20].mean() > 120  # sky above, not below


def test_a_frame_follows_the_arm(plant, renderer):
    plant.reset(0)
    before = renderer.frame(plant.data)
    assert not changed(renderer.frame(plant.data), before).any()
    plant.hold(["right_shoulder_pitch"], [-1.0])
    for _ in range(100):
        plant.step()
    assert changed(renderer.frame(plant.data), before).mean() > 0.01


def red(frame):
    r, g, b = np.moveaxis(frame.astype(int), 2, 0)
    return (r > 100) & (r > 2 * g) & (r > 2 * b)


def test_marks_are_drawn_for_one_frame(plant, renderer):
    marks = [Mark((0.4, -0.4, 1.3), 0.05, (1, 0, 0, 1))]
    assert not red(renderer.frame(plant.data)).any()
    assert red(renderer.frame(plant.data, marks)).sum() > 50
    assert not red(renderer.frame(plant.data)).any()


def test_frames_are_neither_upside_down_nor_mirrored(plant, renderer):
    def row_and_column(position_m):
        frame = renderer.frame(plant.data, [Mark(position_m, 0.04, (1, 0, 0, 1))])
        return np.argwhere(red(frame)).mean(axis=0)

    middle = row_and_column((0.4, -0.1, 1.3))
    assert row_and_column((0.4, -0.1, 1.5))[0] < middle[0] - 20
    assert row_and_column((0.4, -0.3, 1.3))[1] < middle[1] - 20  # its right is the picture's left


def test_too_many_marks_are_refused(plant, renderer):
    with pytest.raises(UsageError) as error:
        renderer.frame(plant.data, [Mark((0, 0, 0))] * 3000)
    used, room = 3000, renderer._scene.maxgeom - renderer._scene.ngeom
    assert 2000 <= room < used
    assert str(error.value) == (
        f"a picture with 3,000 marks cannot be drawn: the scene has room for {room:,} beside the "
        "robot and its floor; cure: fewer marks"
    )
    renderer.frame(plant.data, [Mark((0, 0, 0))] * room)


@pytest.mark.slow
@pytest.mark.usefixtures("renderer")
def test_marks_are_drawn_above_a_floor_of_thousands_of_boxes():
    plant = PerturbedPlant(Perturbation(terrain="boxes:0.01"))
    assert plant.model.ngeom > 3600
    with Renderer(plant.model, 320, 180) as renderer:
        without = renderer.frame(plant.data)
        frame = renderer.frame(plant.data, [Mark((0.4, -0.4, 1.3), 0.05, (1, 0, 0, 1))] * 200)
    assert not red(without).any()
    assert red(frame).sum() > 50


@pytest.mark.slow
@pytest.mark.usefixtures("renderer")
def test_renderers_of_both_cameras_live_side_by_side(plant):
    with Renderer(plant.model, 160, 90, "front") as front:
        first = front.frame(plant.data)
        with Renderer(plant.model, 160, 90, "track") as track:
            assert changed(track.frame(plant.data), first).mean() > 0.1
        assert not changed(front.frame(plant.data), first).any()


def test_unknown_camera_lists_the_known_ones(plant):
    with pytest.raises(UsageError) as error:
        Renderer(plant.model, camera="back")
    assert str(error.value) == "unknown camera 'back'; choose from: front, track"


def test_too_large_a_picture_names_the_limit(plant):
    with pytest.raises(UsageError) as error:
        Renderer(plant.model, 1920, 1080)
    assert str(error.value) == (
        "a picture of 1920 x 1080 pixels cannot be drawn; the model allows 1 x 1 to 1280 x 720"
    )


def test_a_missing_opengl_context_says_what_to_install(plant, monkeypatch):
    def absent(width, height):
        raise ImportError("no driver")

    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(render, "_context_class", lambda: absent)
    with pytest.raises(RenderError) as error:
        Renderer(plant.model)
    assert str(error.value) == (
        "no picture can be made: no OpenGL context with MUJOCO_GL=(unset) (no driver); "
        "without a display set MUJOCO_GL=egl and apt-get install libegl1 libegl-mesa0 "
        "libgl1-mesa-dri, or set MUJOCO_GL=osmesa and apt-get install libosmesa6"
    )


class BrokenContext:
    """An OpenGL context that exists and cannot be drawn in."""

    freed = 0

    def __init__(self, width, height):
        pass

    def make_current(self):
        raise RuntimeError("no surface")

    def free(self):
        BrokenContext.freed += 1


def test_a_context_that_cannot_be_drawn_in_is_freed(plant, monkeypatch):
    monkeypatch.setattr(render, "_context_class", lambda: BrokenContext)
    with pytest.raises(RenderError, match="no surface"):
        Renderer(plant.model)
    assert BrokenContext.freed == 1


def last_line(code, **environment):
    """Return the last line a fresh interpreter writes to stderr."""
    run = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    return run.stderr.strip().splitlines()[-1]


@pytest.mark.slow
def test_physics_works_with_graphics_disabled_and_rendering_names_the_cause():
    code = (
        "from spikeport.robot.plant import Plant; from spikeport.robot.render import Renderer\n"
        "plant = Plant(); plant.step(); Renderer(plant.model)"
    )
    assert last_line(code, MUJOCO_GL="disabled").startswith(
        "spikeport.errors.RenderError: no picture can be made: "
        "no OpenGL context with MUJOCO_GL=disabled ("
    )


def test_a_backend_that_breaks_the_import_of_mujoco_is_named():
    assert last_line("import spikeport.robot.plant", MUJOCO_GL="bogus") == (
        "spikeport.errors.RenderError: mujoco cannot be imported with MUJOCO_GL=bogus "
        "(invalid value for environment variable MUJOCO_GL: bogus); "
        "unset MUJOCO_GL, or install the library it names (osmesa: apt-get install libosmesa6)"
    )


def test_absent_mujoco_names_the_extra():
    code = "import sys; sys.modules['mujoco'] = None; import spikeport.robot.plant"
    assert last_line(code).startswith(
        "spikeport.errors.MissingExtraError: the robot needs the package mujoco, which cannot be "
        "imported (import of mujoco halted; None in sys.modules); install it with: pip install "
    )


@pytest.mark.parametrize(
    ("set_", "chosen"),
    [({}, "mujoco.egl"), ({"MUJOCO_GL": "egl"}, None), ({"DISPLAY": ":0"}, None)],
)
def test_egl_is_chosen_only_without_a_display_and_without_mujoco_gl(monkeypatch, set_, chosen):
    for name in ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    for name, value in set_.items():
        monkeypatch.setenv(name, value)
    theirs = object()
    monkeypatch.setattr(render.mujoco, "GLContext", theirs, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    if chosen:
        assert render._context_class().__module__ == chosen
    else:
        assert render._context_class() is theirs
