"""Progress: how long work says how far it is."""

from collections.abc import Callable

Progress = Callable[[str, float | None], None]
"""A function of what is being done, and the share of it that is done (None where not known)."""


def silent(_what: str, _share: float | None) -> None:
    """Report no progress."""
