"""Progress reports of long work."""

from collections.abc import Callable, Sequence

Progress = Callable[[str, float | None], None]
"""A function of the work's name, and of the share of it that is done (None if unknown)."""


def silent(_what: str, _share: float | None) -> None:
    """Report no progress."""


def say_nothing(_line: str) -> None:
    """Say nothing, in place of a function that prints lines."""


class Stages:
    """A sequence of stages, each of which is reported when it begins.

    Parameters
    ----------
    progress : callable
        The function to report to.
    work : str
        The work that the stages make up, e.g. ``"compiling"``.
    names : sequence of str
        The names of the stages, each once.
    """

    def __init__(self, progress: Progress, work: str, names: Sequence[str]) -> None:
        self._progress, self._work, self._names = progress, work, names

    def begin(self, name: str) -> None:
        """Report that a stage begins, with the share of the stages that are done."""
        self._progress(f"{self._work}: {name}", self._names.index(name) / len(self._names))
