"""Pictures of the robot, without a display."""

import os
import sys
from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol, Self

import numpy as np

from spikeport.errors import RenderError, UsageError, unknown
from spikeport.robot.engine import mujoco

_ADDED_SHAPES = 2000
"""Shapes of a scene besides those of its model: marks, and MuJoCo's additions, such as sites."""


class Mark(NamedTuple):
    """A ball drawn into a picture, e.g. a target: world position and radius in m, colour 0 to 1."""

    position_m: Sequence[float]
    radius_m: float = 0.02
    rgba: Sequence[float] = (0.9, 0.2, 0.1, 1.0)


class _GLContext(Protocol):
    """A context of any of MuJoCo's backends of OpenGL."""

    def make_current(self) -> None: ...
    def free(self) -> None: ...


class Renderer:
    """Renderer of a model, from one of its cameras.

    Parameters
    ----------
    model : mujoco.MjModel
        The model to draw, e.g. ``Plant.model``.
    width, height : int
        Size of the picture in pixels, at most the size of the model's framebuffer.
    camera : str
        Name of a camera of the model; the H1 has ``"front"`` (upper body) and ``"track"`` (whole).

    Raises
    ------
    UsageError
        The camera is not known or the picture too large.
    RenderError
        No OpenGL context can be made on this machine.
    """

    def __init__(
        self, model: mujoco.MjModel, width: int = 640, height: int = 360, camera: str = "front"
    ) -> None:
        cameras = [model.camera(i).name for i in range(model.ncam)]
        if camera not in cameras:
            raise unknown("camera", camera, cameras)
        _check_size(model, width, height)
        self._model = model
        self._gl, self._context = _open(model, width, height)
        self._scene = mujoco.MjvScene(model, model.ngeom + _ADDED_SHAPES)
        self._option = mujoco.MjvOption()
        self._rectangle = mujoco.MjrRect(0, 0, width, height)
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._camera.fixedcamid = cameras.index(camera)

    def frame(self, data: mujoco.MjData, marks: Sequence[Mark] = ()) -> np.ndarray:
        """Return the picture of ``data``, uint8 ``(height, width, 3)``, with marks.

        Raises
        ------
        UsageError
            If there are more marks than fit into the scene.
        """
        self._gl.make_current()
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(
            self._model, data, self._option, None, self._camera, everything, self._scene
        )
        _check_room(self._scene, len(marks))
        for mark in marks:
            _draw(self._scene, mark)
        pixels = np.empty((self._rectangle.height, self._rectangle.width, 3), np.uint8)
        mujoco.mjr_render(self._rectangle, self._scene, self._context)
        mujoco.mjr_readPixels(pixels, None, self._rectangle, self._context)
        return pixels[::-1].copy()  # OpenGL's first row is the lowest

    def close(self) -> None:
        """Free the graphics context; the renderer cannot draw afterwards."""
        self._gl.make_current()
        self._context.free()
        self._gl.free()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _check_size(model: mujoco.MjModel, width: int, height: int) -> None:
    largest = model.vis.global_.offwidth, model.vis.global_.offheight
    if not (0 < width <= largest[0] and 0 < height <= largest[1]):
        raise UsageError(
            f"a picture of {width} x {height} pixels cannot be drawn; "
            f"the model allows 1 x 1 to {largest[0]} x {largest[1]}"
        )


def _context_class() -> Callable[[int, int], _GLContext]:
    """Return mujoco's choice if MUJOCO_GL or a display is set, or off Linux; otherwise EGL."""
    stated = any(os.environ.get(name) for name in ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY"))
    chosen: Callable[[int, int], _GLContext]
    if stated or sys.platform != "linux":
        chosen = mujoco.GLContext
    else:
        from mujoco import egl

        chosen = egl.GLContext
    return chosen


def _open(model: mujoco.MjModel, width: int, height: int) -> tuple[_GLContext, mujoco.MjrContext]:
    try:
        gl = _context_class()(width, height)
        try:
            gl.make_current()
            context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        except BaseException:
            gl.free()
            raise
    except Exception as error:  # each backend and driver raises errors of its own
        setting = os.environ.get("MUJOCO_GL") or "(unset)"
        raise RenderError(
            f"no picture can be made: no OpenGL context with MUJOCO_GL={setting} ({error}); "
            "without a display set MUJOCO_GL=egl and apt-get install libegl1 libegl-mesa0 "
            "libgl1-mesa-dri, or set MUJOCO_GL=osmesa and apt-get install libosmesa6"
        ) from error
    mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, context)
    return gl, context


def _check_room(scene: mujoco.MjvScene, n_marks: int) -> None:
    room = scene.maxgeom - scene.ngeom
    if n_marks > room:
        raise UsageError(
            f"a picture with {n_marks:,} marks cannot be drawn: the scene has room for {room:,} "
            "beside the robot and its floor; cure: fewer marks"
        )


def _draw(scene: mujoco.MjvScene, mark: Mark) -> None:
    mujoco.mjv_initGeom(
        scene.geoms[scene.ngeom],
        mujoco.mjtGeom.mjGEOM_SPHERE,
        np.full(3, float(mark.radius_m)),
        np.asarray(mark.position_m, dtype=float),
        np.eye(3).ravel(),
        np.asarray(mark.rgba, dtype=np.float32),
    )
    scene.ngeom += 1
