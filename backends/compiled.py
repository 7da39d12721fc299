"""Compiled functions, made ready before they are called."""

from collections.abc import Callable

from numba import typeof
from numba.core.dispatcher import Dispatcher


def make_ready(function: "Dispatcher[Callable[..., object]]", *arguments: object) -> None:
    """Compile a function for arguments of these types, or load it from the cache on disk.

    Compiling takes seconds, the call that comes first microseconds: a measurement of steps
    should not time both.
    """
    function.compile(tuple(typeof(argument) for argument in arguments))
