"""Pictures and videos of a run, drawn from its recorded poses."""

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from PIL import Image, ImageDraw, ImageFont

from spikeport.counted import counted
from spikeport.errors import RenderError
from spikeport.experiments.loop import Port
from spikeport.experiments.run_folder import Result
from spikeport.robot.engine import mujoco
from spikeport.robot.plant import Plant
from spikeport.robot.render import Mark, Renderer
from spikeport.robot.video import VideoWriter

FPS = 25
VIDEO_FILE = "video.mp4"
PICTURE, VIDEO = (720, 540), (960, 720)
"""Widths and heights in pixels."""
BAR = 56
"""Height of a caption's bar, in pixels."""

Marks = Callable[[int], Sequence[Mark]]
"""A function of the number of poses so far, which returns the marks in a picture."""


def cores_of(result: Result) -> str:
    """Return the cores of a run for its title, with a comma before them; "" without a chip."""
    used = result["resources"]
    return "" if used is None else f", {counted(used['cores']['used'], 'core')}"


class Film(Port):
    """A port that only watches: it keeps the robot's poses for pictures.

    Parameters
    ----------
    plant : Plant
        The robot.

    Attributes
    ----------
    poses : list of array
        MuJoCo's ``qpos`` at every physics step.
    """

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        self.poses: list[np.ndarray] = []

    def begin(self) -> None:
        """Forget the poses."""
        self.poses = []

    def observe(self) -> np.ndarray:
        """Return no value."""
        return np.empty(0)

    def drive(self, _values: np.ndarray) -> None:
        """Keep the pose."""
        self.poses.append(self.plant.data.qpos.copy())


def with_poses(series: xr.Dataset, film: Film) -> xr.Dataset:
    """Return time series with the robot's poses, MuJoCo's ``qpos``, one for each of ``time``."""
    text = "the robot's pose, MuJoCo's qpos, at the beginning of the step"
    poses = ("time", "coordinate"), np.array(film.poses), {"units": "m, 1, rad", "long_name": text}
    return series.assign(qpos=poses)


class Caption(NamedTuple):
    """A line of text on a bar of a colour, as ``#rrggbb``."""

    text: str
    colour: str


Captions = Callable[[int], Caption]
"""A function of the number of poses so far, which returns the line above a picture."""


class Scenes(NamedTuple):
    """The pictures and the video of a run.

    ``steps`` are the numbers of the poses that the figure shows; None for the end of the run.
    """

    marks: Marks
    camera: str = "front"
    captions: Captions | None = None
    steps: Sequence[int] | None = None


def draw_scenes(film: Film, scenes: Scenes) -> tuple[np.ndarray, ...]:
    """Return the pictures of a run, uint8 (height, width, 3); none without graphics."""
    plant, marks = film.plant, scenes.marks
    try:
        with Renderer(plant.model, *PICTURE, scenes.camera) as renderer:
            if scenes.steps is None:
                return (renderer.frame(plant.data, marks(len(film.poses))),)
            return tuple(_frame(renderer, film, marks, step) for step in scenes.steps)
    except RenderError:
        return ()


def check_video(plant: Plant) -> None:
    """Check before a run that this machine can draw and encode its video: a video of one picture.

    Raises
    ------
    RenderError, MissingExtraError, OSError
        If it cannot.
    """
    width, height = VIDEO
    with (
        Renderer(plant.model, *VIDEO, "front"),
        tempfile.TemporaryDirectory() as scratch,
        VideoWriter(Path(scratch) / VIDEO_FILE, FPS) as video,
    ):
        video.add(np.zeros((height, width, 3), np.uint8))


def write_video(folder: Path, film: Film, scenes: Scenes) -> None:
    """Write ``video.mp4``, which plays in real time; raises the errors of `check_video`."""
    plant, captions = film.plant, scenes.captions
    with (
        Renderer(plant.model, *VIDEO, scenes.camera) as renderer,
        VideoWriter(folder / VIDEO_FILE, FPS) as video,
    ):
        for i in range(0, len(film.poses), round(1 / (FPS * plant.dt_s))):
            frame = _frame(renderer, film, scenes.marks, i)
            video.add(frame if captions is None else captioned(frame, captions(i + 1)))


def show_picture(axes: Axes, picture: np.ndarray) -> None:
    """Show a picture of the robot on axes."""
    axes.imshow(picture)
    axes.set_axis_off()


def captioned(frame: np.ndarray, caption: Caption) -> np.ndarray:
    """Put a caption above a picture, uint8 (height, width, 3)."""
    bar = Image.new("RGB", (frame.shape[1], BAR), caption.colour)
    font = ImageFont.load_default(size=BAR // 2)
    middle = BAR // 2
    ImageDraw.Draw(bar).text((middle, middle), caption.text, "white", font, anchor="lm")
    return np.vstack((np.asarray(bar), frame))


def _frame(renderer: Renderer, film: Film, marks: Marks, step: int) -> np.ndarray:
    plant = film.plant
    # The run is over, so its plant can be posed for pictures.
    plant.data.qpos[:] = film.poses[step]
    mujoco.mj_forward(plant.model, plant.data)
    return renderer.frame(plant.data, marks(step + 1))
