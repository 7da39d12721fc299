"""Pictures and videos of a run, drawn from its recorded poses."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

import mujoco
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from spikeport.errors import RenderError
from spikeport.robot.plant import Plant
from spikeport.robot.render import Mark, Renderer
from spikeport.robot.video import VideoWriter

FPS = 25
BAR = 56
"""Height of a caption's bar, in pixels."""

Marks = Callable[[int], Sequence[Mark]]
"""What is drawn into a picture, from the number of poses up to then."""


class Caption(NamedTuple):
    """A line of text on a bar of a colour, as ``#rrggbb``."""

    text: str
    colour: str


Captions = Callable[[int], Caption]
"""What is written above a picture, from the number of poses up to then."""


class Filmed(Protocol):
    """A robot in closed loop, and its ``qpos`` at every physics step."""

    plant: Plant
    poses: list[np.ndarray]


def picture(loop: Filmed, marks: Marks, camera: str = "front") -> np.ndarray | None:
    """The robot at the end of a run; None without graphics."""
    try:
        with Renderer(loop.plant.model, 720, 540, camera) as renderer:
            return renderer.frame(loop.plant.data, marks(len(loop.poses)))
    except RenderError:
        return None


def pictures(
    loop: Filmed, marks: Marks, steps: Sequence[int], camera: str = "front"
) -> tuple[np.ndarray, ...]:
    """The robot at some of its poses; none without graphics."""
    try:
        with Renderer(loop.plant.model, 720, 540, camera) as renderer:
            return tuple(_frame(renderer, loop, marks, step) for step in steps)
    except RenderError:
        return ()


def check_video(folder: Path, loop: Filmed) -> None:
    """Say before a run, not after it, that this machine cannot draw or encode.

    Raises
    ------
    RenderError, MissingExtraError
        If it cannot.
    """
    with _video_renderer(loop, "front"), _writer(folder):
        pass


def write_video(
    folder: Path,
    loop: Filmed,
    marks: Marks,
    camera: str = "front",
    captions: Captions | None = None,
) -> None:
    """Write ``video.mp4``, in real time; raises what `check_video` does."""
    with _video_renderer(loop, camera) as renderer, _writer(folder) as video:
        for i in range(0, len(loop.poses), round(1 / (FPS * loop.plant.dt_s))):
            frame = _frame(renderer, loop, marks, i)
            video.add(frame if captions is None else captioned(frame, captions(i + 1)))


def captioned(frame: np.ndarray, caption: Caption) -> np.ndarray:
    """A picture, uint8 (height, width, 3), with a caption above it."""
    bar = Image.new("RGB", (frame.shape[1], BAR), caption.colour)
    font = ImageFont.load_default(size=BAR // 2)
    middle = BAR // 2
    ImageDraw.Draw(bar).text((middle, middle), caption.text, "white", font, anchor="lm")
    return np.vstack((np.asarray(bar), frame))


def _frame(renderer: Renderer, loop: Filmed, marks: Marks, step: int) -> np.ndarray:
    plant = loop.plant
    plant.data.qpos[:] = loop.poses[step]
    mujoco.mj_forward(plant.model, plant.data)
    return renderer.frame(plant.data, marks(step + 1))


def _video_renderer(loop: Filmed, camera: str) -> Renderer:
    return Renderer(loop.plant.model, 960, 720, camera)


def _writer(folder: Path) -> VideoWriter:
    return VideoWriter(folder / "video.mp4", FPS)
