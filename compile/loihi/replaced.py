"""Parts of nengo-loihi that are replaced while it works for us."""

import contextlib
from collections.abc import Iterator
from types import ModuleType


@contextlib.contextmanager
def replaced(owner: object, name: str, new: object) -> Iterator[None]:
    """Replace an attribute of a class or a module within the context.

    Every thread sees it: whoever replaces a part that others use holds `refusal.TURN`.
    """
    usual = getattr(owner, name)
    setattr(owner, name, new)
    try:
        yield
    finally:
        setattr(owner, name, usual)


class StandIn:
    """A module, but for some of its names.

    Parameters
    ----------
    module : module
        The module that it stands in for.
    **instead
        The names that are others, and what they are.
    """

    def __init__(self, module: ModuleType, **instead: object) -> None:
        self._module = module
        self.__dict__.update(instead)

    def __getattr__(self, name: str) -> object:
        found = getattr(self._module, name)
        setattr(self, name, found)  # builders ask thousands of times
        return found
