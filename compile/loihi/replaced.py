"""Temporary replacements for parts of nengo-loihi."""

import contextlib
from collections.abc import Iterator
from types import ModuleType

from spikeport.compile.ground.notices import TURN


@contextlib.contextmanager
def replaced(
    owner: object, name: str, new: object, turn: contextlib.AbstractContextManager[object] = TURN
) -> Iterator[None]:
    """Replace an attribute of a class or a module within the context.

    Every thread sees the replacement, so threads take turns.
    """
    with turn:
        usual = getattr(owner, name)
        setattr(owner, name, new)
        try:
            yield
        finally:
            setattr(owner, name, usual)


class StandIn:
    """A module with some of its names replaced.

    Parameters
    ----------
    module : module
        The module that it stands in for.
    **instead
        The replaced names, and their new values.
    """

    def __init__(self, module: ModuleType, **instead: object) -> None:
        self._module = module
        self.__dict__.update(instead)

    def __getattr__(self, name: str) -> object:
        found = getattr(self._module, name)
        setattr(self, name, found)  # builders look a name up thousands of times
        return found
