"""Compiles that are kept from run to run: the image, the report, and the host's part.

A network is compiled again if anything that decides the result has changed: see
`spikeport.compile.ground.identity` for the network, `spikeport.cache` for everything else.
"""

import functools
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import nengo
import numpy as np
from nengo.exceptions import NengoException

from spikeport.backends.host_program import HostProgram, host_program
from spikeport.backends.kept_host import (
    HostReader,
    HostWriter,
    UsersObjects,
)
from spikeport.backends.kept_values import NotKeptError, Reader
from spikeport.cache import Arrays, Cache, Nothing
from spikeport.compile.ground.identity import identity
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import read_header
from spikeport.compile.loihi.build_settings import BuildSettings
from spikeport.compile.passes.pipeline import Pipeline
from spikeport.compile.pipeline import Compilation
from spikeport.compile.report.report import Report
from spikeport.digest import digest_of
from spikeport.errors import ImageError, UsageError
from spikeport.hardware_models.chip import ChipModel
from spikeport.reading.mismatch import MismatchError

HEADER, IMAGE = "header", "image/"
"""The name of the image's header, and the prefix of the names of its arrays."""
OURS = "spikeport."
"""Prefix of the modules whose code is part of every key."""
MOST_BYTES = 256 << 20
"""The largest entry: a larger one takes about as long to read as it saves."""
UNREADABLE = (
    LookupError,
    TypeError,
    ValueError,
    ArithmeticError,
    AttributeError,
    AssertionError,
    RecursionError,
    ImportError,
    ImageError,
    NengoException,
)
"""Errors of reading an entry that is intact, but was not written by this module."""

Compile = Callable[[], Compilation]


@dataclass(frozen=True)
class KeptCompilation(Compilation):
    """A compiled network from a cache, with its host; its blocks are compiled at first use.

    ``again`` compiles the network, once. The built parameters need that: they include the points
    that decoders are solved at, whose size can be a hundred times that of everything that runs.
    """

    program: HostProgram | None = None
    again: Compile | None = None


def program_of(compilation: Compilation) -> HostProgram:
    """Return the host's part of a compilation."""
    if isinstance(compilation, KeptCompilation) and compilation.program is not None:
        return compilation.program
    return host_program(compilation)


def fresh(compilation: Compilation) -> Compilation:
    """Return a compilation with all that a compile makes: one from a cache is compiled again."""
    if isinstance(compilation, KeptCompilation) and compilation.again is not None:
        return compilation.again()
    return compilation


class CompileRequest(NamedTuple):
    """A network to compile, and everything else that decides the result."""

    network: nengo.Network
    chip: ChipModel
    dt_s: float
    pipeline: Pipeline
    settings: BuildSettings
    offload: bool


def compiled(request: CompileRequest, kept: Cache, compile_it: Compile) -> Compilation:
    """Return the compilation from the cache; if there is none, compile the network and keep it.

    A network that has no identity, or whose host cannot be kept in a cache, is compiled each time;
    a warning says why.
    """
    if isinstance(kept, Nothing):
        return compile_it()
    try:
        _check_passes(request.pipeline)
        inputs = _inputs(request)
    except TypeError as error:
        return _each_time(error, compile_it)
    once = functools.cache(compile_it)
    try:
        arrays = kept.kept("compile", inputs, lambda: arrays_of(once(), request.network))
    except NotKeptError as error:
        return _each_time(error, once)
    # Return a fresh compile itself: it has its blocks, which an entry of the cache lacks.
    if once.cache_info().currsize:
        return once()
    return _found(arrays, request, _if_unchanged(request, inputs, compile_it))


def _if_unchanged(request: CompileRequest, inputs: str, compile_it: Compile) -> Compile:
    """Return a compile that raises UsageError if the network is no longer that of the inputs."""

    def compile_again() -> Compilation:
        if _inputs(request) != inputs:
            raise UsageError(
                "the network was changed after it was compiled, and a compile from the cache has "
                "no built parameters or blocks of its own; cure: read them before the change, or "
                "compile without the cache"
            )
        return compile_it()

    return compile_again


def _inputs(request: CompileRequest) -> str:
    """Return the digest of a request; TypeError if an object or a function has no identity."""
    return digest_of((identity(request.network), *request[1:]))


def _check_passes(pipeline: Pipeline) -> None:
    """Raise TypeError for a pass of the user's: its options do not say what it does."""
    for one in pipeline.passes:
        if not type(one).__module__.startswith(OURS):
            raise TypeError(f"pass {one.name} of {type(one).__module__} has no identity that lasts")


def _found(arrays: Arrays, request: CompileRequest, compile_it: Compile) -> Compilation:
    """Return the compilation of an entry, or compile again if it cannot be read."""
    try:
        found = read(arrays, request, compile_it)
    except MismatchError as error:
        warnings.warn(f"cache: {error}; the network is compiled again", stacklevel=3)
        return compile_it()
    # A kept compile gives the same warnings as a fresh one.
    for notice in found.report.warnings:
        warnings.warn(notice, stacklevel=3)
    return found


def _each_time(why: TypeError, compile_it: Compile) -> Compilation:
    warnings.warn(f"cache: {why}; the network is compiled in each run", stacklevel=3)
    return compile_it()


def arrays_of(compilation: Compilation, network: nengo.Network) -> Arrays:
    """Return a compilation as arrays, for a cache.

    Raises
    ------
    NotKeptError
        If a part of it cannot be kept in a cache.
    """
    users, program = UsersObjects(network), host_program(compilation)
    if program.events:
        raise NotKeptError("inputs that read events from files cannot be kept in a cache")
    host = HostWriter(users, program)
    chip: Any = None  # not kept: it is in the key
    report = replace(compilation.report, chip=chip)
    tree = {
        "host": host.program(compilation.stand_ins),
        "report": host.values.write(report),
    }
    image = compilation.image
    arrays = {IMAGE + name: array for name, array in image.arrays.items()}
    header = np.frombuffer(image.header, np.uint8)
    found = {**host.values.arrays(tree), HEADER: header, **arrays}
    if (size := sum(array.nbytes for array in found.values())) > MOST_BYTES:
        raise NotKeptError(
            f"the compiled network takes {size >> 20:,} MB, limit {MOST_BYTES >> 20:,} MB"
        )
    return found


def read(arrays: Arrays, request: CompileRequest, compile_it: Compile) -> KeptCompilation:
    """Return the compilation in the arrays of a cache.

    Raises
    ------
    MismatchError
        If they hold no compilation, or that of another network.
    """
    try:
        return _read(arrays, request, compile_it)
    except UNREADABLE as error:
        raise MismatchError("a kept compile", f"something else ({error})") from error


def _read(arrays: Arrays, request: CompileRequest, compile_it: Compile) -> KeptCompilation:
    header = read_header(arrays[HEADER].tobytes())
    tables = {n.removeprefix(IMAGE): a for n, a in arrays.items() if n.startswith(IMAGE)}
    image = ChipImage.from_header(header, tables)
    users = UsersObjects(request.network)
    reader = Reader(arrays)
    host = HostReader(reader, reader.tree["host"], users)
    report: Report = reader.read(reader.tree["report"])
    # One compile gives both the blocks and Nengo's parameters, whichever is used first.
    again = functools.cache(compile_it)
    return KeptCompilation(
        image,
        replace(report, chip=request.chip),
        lambda: again().blocks,
        program=host.program(),
        again=again,
    )
