"""A writer of pictures to an mp4 file, which appears complete or not at all."""

import errno
import re
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Self

import numpy as np

from spikeport.atomic import atomic_path
from spikeport.errors import UsageError, printable
from spikeport.extras import missing

ENCODED = ("-an", "-vcodec", "libx264", "-pix_fmt", "yuv420p", "-f", "mp4")
"""Options of a video that every player shows: H.264, with 4:2:0 colour, in its own size."""


class VideoWriter:
    """Writer of frames of one even size as H.264; use it as a context manager.

    Leaving the context puts the file at ``path``, if it has a frame; leaving it with an error
    leaves no file.

    Parameters
    ----------
    path : str or Path
        The file, ending in ``.mp4``; an older one is replaced.
    fps : float
        Frames per second.

    Raises
    ------
    MissingExtraError
        The package of the extra ``video`` is absent.
    OSError
        From `add` or the end of the context, if the video cannot be written, as on a full disk.
    """

    def __init__(self, path: str | Path, fps: float) -> None:
        if find_spec("imageio_ffmpeg") is None:
            raise missing("a video", "imageio-ffmpeg", "video")
        self._path, self._fps = Path(path), fps
        self._encoding = ExitStack()
        self._pictures: IO[bytes] | None = None

    def add(self, frame: np.ndarray) -> None:
        """Append a picture, uint8 ``(height, width, 3)``; raises `UsageError` for an odd size."""
        height, width = frame.shape[:2]
        if height % 2 or width % 2:
            raise UsageError(f"a video of {width} x {height} pixels; H.264 needs even numbers")
        if self._pictures is None:
            opened = _encoded(self._path, width, height, self._fps)
            self._pictures = self._encoding.enter_context(opened)
        self._pictures.write(frame.tobytes())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._encoding.__exit__(*error)  # type: ignore[arg-type]


@contextmanager
def _encoded(path: Path, width: int, height: int, fps: float) -> Iterator[IO[bytes]]:
    """Yield a file for pictures, which are encoded into a video at ``path`` as the block ends."""
    from imageio_ffmpeg import get_ffmpeg_exe

    try:
        program = get_ffmpeg_exe()
    except RuntimeError as error:  # its wheel for this machine has no program
        raise missing("a video", "ffmpeg", "video") from error
    pictures = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(fps))
    with atomic_path(path) as part, tempfile.TemporaryFile() as words:
        command = [program, "-y", "-v", "error", *pictures, "-i", "-", *ENCODED]
        encoder = subprocess.Popen(
            [*command, f"file:{part}"],  # else a folder with a colon would be a protocol
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=words,
            start_new_session=True,  # Ctrl-C reaches this process alone, which ends the encoder
        )
        assert encoder.stdin is not None
        try:
            yield encoder.stdin
            encoder.communicate()  # closes the pipe, and waits
        except BrokenPipeError:  # the encoder has ended early
            pass
        finally:
            encoder.kill()
            encoder.communicate()
        if encoder.returncode:
            words.seek(0)
            raise OSError(errno.EIO, f"no video: {_reason(words.read())}", str(path))


def _reason(words: bytes) -> str:
    """Return the encoder's first line, which has the cause, without the part that speaks."""
    first = words.decode(errors="replace").strip().partition("\n")[0]
    return printable(re.sub(r"^\[.*?\] ", "", first)) or "the encoder ended early"
