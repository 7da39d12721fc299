"""Compiled functions, made ready before they are called."""

from typing import Any

from numba import typeof


def make_ready(function: Any, *arguments: Any) -> None:
    """Compile a function for arguments of these types, or load it from the cache on disk.

    Compiling takes seconds, the call that comes first microseconds: a measurement of steps
    should not time both.
    """
    function.compile(tuple(typeof(argument) for argument in arguments))
