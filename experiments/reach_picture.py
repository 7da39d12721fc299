"""Pictures and videos of a reach run, drawn from its recorded poses."""

from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np

from spikeport.errors import RenderError
from spikeport.experiments.arm_loop import ArmLoop, Sample
from spikeport.robot.render import Mark, Renderer
from spikeport.robot.video import VideoWriter

FPS = 25
TRACE_SAMPLES = 200
TARGET_RGBA = (0.95, 0.45, 0.05, 1.0)
TRACE_RGBA = (0.1, 0.65, 0.25, 1.0)


def picture(loop: ArmLoop) -> np.ndarray | None:
    """The robot at the end of a run, with target and the hand's trace; None without graphics."""
    try:
        with Renderer(loop.plant.model, 720, 540) as renderer:
            return renderer.frame(loop.plant.data, _marks(loop.samples))
    except RenderError:
        return None


def check_video(folder: Path, loop: ArmLoop) -> None:
    """Say before a run, not after it, that this machine cannot draw or encode.

    Raises
    ------
    RenderError, MissingExtraError
        If it cannot.
    """
    with _renderer(loop), _writer(folder):
        pass


def write_video(folder: Path, loop: ArmLoop) -> None:
    """Write ``video.mp4``, in real time; raises what `check_video` does."""
    with _renderer(loop) as renderer, _writer(folder) as video:
        for pose, seen in _frames(loop):
            loop.plant.data.qpos[:] = pose
            mujoco.mj_forward(loop.plant.model, loop.plant.data)
            video.add(renderer.frame(loop.plant.data, _marks(seen)))


def _renderer(loop: ArmLoop) -> Renderer:
    return Renderer(loop.plant.model, 960, 720)


def _writer(folder: Path) -> VideoWriter:
    return VideoWriter(folder / "video.mp4", FPS)


def _frames(loop: ArmLoop) -> Iterator[tuple[np.ndarray, list[Sample]]]:
    every = round(1 / (FPS * loop.plant.dt_s))
    for i in range(0, len(loop.samples), every):
        yield loop.poses[i], loop.samples[max(0, i - TRACE_SAMPLES) : i + 1]


def _marks(samples: list[Sample]) -> list[Mark]:
    trace = [Mark(tuple(s.hand), 0.004, TRACE_RGBA) for s in samples[-TRACE_SAMPLES::2]]
    return [Mark(tuple(samples[-1].target), 0.025, TARGET_RGBA), *trace]
