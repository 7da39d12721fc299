"""Errors of a network's own functions, with the place in the run where they occurred."""

from collections.abc import Callable
from typing import TypeVar

from spikeport.errors import BackendError, SpikeportError, in_words

T = TypeVar("T")


def attempt(where: str, call: Callable[[], T]) -> T:
    """Call a network's functions, and return the result.

    Parameters
    ----------
    where : str
        The place in the run, such as its step.
    call : callable
        The call.

    Raises
    ------
    BackendError
        If a function of the network raises an error; the message names the place.
    """
    # Not a context manager: contextlib mistakes an error raised from a StopIteration for its own.
    try:
        return call()
    except SpikeportError:
        raise
    except Exception as error:  # whatever the functions of the network's nodes raise
        raise BackendError(f"{where}: the network raised {in_words(error)}") from error
