"""Pictures and videos of a run of the arm, drawn from its recorded poses."""

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

from spikeport.errors import RenderError
from spikeport.experiments.arm_loop import ArmLoop, Recording
from spikeport.robot.render import Mark, Renderer
from spikeport.robot.video import VideoWriter

FPS = 25
TRACE_MARKS = 800
TARGET_RGBA = (0.95, 0.45, 0.05, 1.0)
TRACE_RGBA = (0.1, 0.65, 0.25, 1.0)

TraceSince = Callable[[float], float]
"""From when on (s) the hand's trace is shown at a moment (s)."""


def picture(loop: ArmLoop, trace_since: TraceSince) -> np.ndarray | None:
    """The robot at the end of a run, with target and the hand's trace; None without graphics."""
    try:
        with Renderer(loop.plant.model, 720, 540) as renderer:
            marks = _marks(loop.recording(), len(loop.poses), trace_since)
            return renderer.frame(loop.plant.data, marks)
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


def write_video(folder: Path, loop: ArmLoop, trace_since: TraceSince) -> None:
    """Write ``video.mp4``, in real time; raises what `check_video` does."""
    with _renderer(loop) as renderer, _writer(folder) as video:
        recording = loop.recording()
        for i in range(0, len(loop.poses), round(1 / (FPS * loop.plant.dt_s))):
            loop.plant.data.qpos[:] = loop.poses[i]
            mujoco.mj_forward(loop.plant.model, loop.plant.data)
            video.add(renderer.frame(loop.plant.data, _marks(recording, i + 1, trace_since)))


def _renderer(loop: ArmLoop) -> Renderer:
    return Renderer(loop.plant.model, 960, 720)


def _writer(folder: Path) -> VideoWriter:
    return VideoWriter(folder / "video.mp4", FPS)


def _marks(recording: Recording, end: int, trace_since: TraceSince) -> list[Mark]:
    """The target, and where the hand went lately, thinned where there are too many samples."""
    now_s = recording.time_s[end - 1]
    trace = recording.hand[:end][recording.time_s[:end] >= trace_since(now_s)]
    thinned = trace[:: 2 + len(trace) // TRACE_MARKS]
    target = Mark(tuple(recording.target[end - 1]), 0.025, TARGET_RGBA)
    return [target, *(Mark(tuple(hand), 0.004, TRACE_RGBA) for hand in thinned)]
