"""Progress: how long work says how far it is."""

from collections.abc import Callable, Sequence

Progress = Callable[[str, float | None], None]
"""A function of what is being done, and the share of it that is done (None where not known)."""


def silent(_what: str, _share: float | None) -> None:
    """Report no progress."""


class Stages:
    """A row of stages, one after the other, of which each is reported when it begins.

    Parameters
    ----------
    progress : callable
        The function to report to.
    work : str
        The work that all of them make up, e.g. ``"compiling"``.
    names : sequence of str
        Their names, each once.
    """

    def __init__(self, progress: Progress, work: str, names: Sequence[str]) -> None:
        self._progress, self._work, self._names = progress, work, names

    def begin(self, name: str) -> None:
        """Report that a stage begins: the share of the stages before it is done."""
        self._progress(f"{self._work}: {name}", self._names.index(name) / len(self._names))
