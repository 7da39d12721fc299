"""A writer of pictures to an mp4 file, which appears complete or not at all."""

import os
from importlib.util import find_spec
from pathlib import Path
from typing import Protocol, Self

import numpy as np

from spikeport.errors import UsageError
from spikeport.extras import missing


class _Writer(Protocol):
    """The interface of imageio's writers, as imageio has no types."""

    def append_data(self, im: np.ndarray) -> None: ...
    def close(self) -> None: ...


class VideoWriter:
    """Writer of frames of one even size as H.264; use it as a context manager.

    Leaving the context puts the file at ``path``; leaving it with an error leaves no file.

    Parameters
    ----------
    path : str or Path
        The file, ending in ``.mp4``; an older one is replaced.
    fps : float
        Frames per second.

    Raises
    ------
    MissingExtraError
        The packages of the extra ``video`` are absent.
    """

    def __init__(self, path: str | Path, fps: float) -> None:
        for package in ("imageio", "imageio_ffmpeg"):
            if find_spec(package) is None:
                raise missing("a video", package.replace("_", "-"), "video")
        self._path = Path(path)
        self._part = self._path.with_name(f".{self._path.name}.{os.getpid()}.part.mp4")
        self._fps = fps
        self._writer: _Writer | None = None

    def add(self, frame: np.ndarray) -> None:
        """Append a picture, uint8 ``(height, width, 3)``; raises `UsageError` for an odd size."""
        height, width = frame.shape[:2]
        if height % 2 or width % 2:
            raise UsageError(f"a video of {width} x {height} pixels; H.264 needs even numbers")
        if self._writer is None:
            self._writer = _open(self._part, self._fps)
        self._writer.append_data(frame)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if self._writer is None:
            return
        self._writer.close()
        if kind is None:
            os.replace(self._part, self._path)
        else:
            self._part.unlink(missing_ok=True)


def _open(path: Path, fps: float) -> _Writer:
    import imageio.v2 as imageio

    # 4:2:0 colour, and a size not rounded to blocks of 16: every player shows this unscaled
    return imageio.get_writer(
        path, format="FFMPEG", fps=fps, codec="libx264", pixelformat="yuv420p", macro_block_size=2
    )
