"""The errors of a network's functions, named where a run calls them."""

from collections.abc import Callable
from typing import TypeVar

from spikeport.errors import BackendError, SpikeportError, in_words

T = TypeVar("T")


def attempt(where: str, call: Callable[[], T]) -> T:
    """Return what a call of a network's functions returns.

    Parameters
    ----------
    where : str
        The place in the run, such as its step.
    call : callable
        The call.

    Raises
    ------
    BackendError
        If a function of the network raises an error; it names the place.
    """
    # No context manager: contextlib takes our error from a StopIteration for one of its own.
    try:
        return call()
    except SpikeportError:
        raise
    except Exception as error:  # whatever the functions of the network's nodes raise
        raise BackendError(f"{where}: the network raised {in_words(error)}") from error
