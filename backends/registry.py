"""The backends by name, and the way that each opens a network."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import nengo

from spikeport.backends.board.link import OWN_STUB, LinkOptions, record_of
from spikeport.backends.chip import Chip
from spikeport.backends.execution import Execution
from spikeport.backends.kept import CompileRequest, compiled
from spikeport.backends.nengo_loihi import NengoLoihiChip
from spikeport.backends.reference import Reference, fused
from spikeport.backends.step_log import LogOptions
from spikeport.cache import NOTHING, Cache
from spikeport.compile.check.violation import NothingOnChipError
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.loihi.build_settings import AS_USUAL, BuildSettings
from spikeport.compile.passes.parse import targeted
from spikeport.compile.passes.pipeline import Pipeline
from spikeport.compile.pipeline import Compilation, compile_network
from spikeport.errors import UsageError, unknown
from spikeport.progress import Progress, silent


class Source(NamedTuple):
    """A network, with the arguments of its compile and of its run.

    Attributes
    ----------
    network, chip, dt_s, pipeline, offload, settings, progress
        The arguments of `compile_network`; ``dt_s`` is its ``dt``.
    counts : Path, optional
        A folder for the counts of every step, see `spikeport.backends.step_log.StepLog`.
    link : LinkOptions
        The way to a board.
    cache : Cache
        The cache of compiles.
    """

    network: nengo.Network
    chip: str | Path
    dt_s: float
    pipeline: Pipeline | str | None
    counts: Path | None = None
    offload: bool = False
    settings: BuildSettings = AS_USUAL
    progress: Progress = silent
    link: LinkOptions = OWN_STUB
    cache: Cache = NOTHING

    def compiled(self) -> Compilation:
        """Return the compile from the cache; if there is none, compile the network."""
        chip, pipeline = targeted(str(self.chip), self.pipeline)
        request = CompileRequest(
            self.network, chip, self.dt_s, pipeline, self.settings, self.offload
        )
        return compiled(request, self.cache, self._compile)

    def _compile(self) -> Compilation:
        return compile_network(
            self.network,
            self.chip,
            self.dt_s,
            self.pipeline,
            offload=self.offload,
            settings=self.settings,
            progress=self.progress,
        )


LOADING = "loading kernels (compiled when first used)"
"""The name of the stage after a compile, for progress."""

Open = Callable[[Source, int, Execution | None], Execution]
"""A function that opens a network, with a seed; it uses what an earlier execution has built."""


@dataclass(frozen=True)
class Backend:
    """A backend: one way to run a network."""

    name: str
    summary: str
    open: Open


def _on(load: Callable[[ChipImage, int, LogOptions, LinkOptions], Chip]) -> Open:
    """Return a function that compiles a network, and loads its image; the rest is on the host.

    A network with nothing for the chip runs on the host alone, in float Nengo.
    """

    def open_source(source: Source, seed: int, earlier: Execution | None) -> Execution:
        if isinstance(earlier, Reference):
            return _without_chip(source, seed, earlier)
        try:
            found = (earlier and earlier.compilation) or source.compiled()
        except NothingOnChipError as nothing:
            # for the caller of Simulator or its reset
            warnings.warn("\n".join([nothing.verdict, *map(str, nothing.offloaded)]), stacklevel=4)
            return _without_chip(source, seed, None)
        log = LogOptions(found.report.chip, source.counts)
        source.progress(LOADING, None)
        from spikeport.backends.host_loop import HostLoop  # loads numba: not before use

        chip = load(found.image, seed, log, source.link)
        try:
            return HostLoop(found, chip, seed)
        except BaseException:
            chip.close()  # otherwise a board would wait for its host
            raise

    return open_source


def _without_chip(source: Source, seed: int, earlier: Execution | None) -> Execution:
    log = LogOptions(folder=source.counts)
    if isinstance(earlier, Reference):
        return earlier.again(seed, log)
    chip, pipeline = targeted(str(source.chip), source.pipeline)
    rewrite = fused(source.network, chip, source.dt_s, pipeline)
    return Reference(rewrite, source.dt_s, seed, log)


def _native(image: ChipImage, seed: int, log: LogOptions, _: LinkOptions) -> Chip:
    from spikeport.backends.native.chip import NativeChip  # likewise

    return NativeChip(image, seed, log)


def _native_threads(image: ChipImage, seed: int, log: LogOptions, _: LinkOptions) -> Chip:
    from spikeport.backends.native.chip import NativeChip  # likewise
    from spikeport.backends.native.shards import available

    return NativeChip(image, seed, log, available())


def _board(image: ChipImage, seed: int, log: LogOptions, link: LinkOptions) -> Chip:
    from spikeport.backends.board.opening import on_board

    return on_board(image, seed, log, link)


def _replay(image: ChipImage, seed: int, log: LogOptions, link: LinkOptions) -> Chip:
    from spikeport.backends.replay import ReplayChip

    return ReplayChip(image, seed, record_of(link), log)


def _nengo_loihi(image: ChipImage, seed: int, log: LogOptions, _: LinkOptions) -> Chip:
    return NengoLoihiChip(image, seed, log)


BACKENDS = {
    backend.name: backend
    for backend in (
        Backend("reference", "float Nengo, no chip: what the network computes", _without_chip),
        Backend(
            "native", "the image on compiled kernels, equal to nengo-loihi's emulator", _on(_native)
        ),
        Backend(
            "native-threads",
            "native, with its cores divided among all processors: for large chips",
            _on(_native_threads),
        ),
        Backend("nengo-loihi", "the image on nengo-loihi's emulator", _on(_nengo_loihi)),
        Backend("board", "the image on a board, or its stub, at the end of a link", _on(_board)),
        Backend("replay", "a recorded session of a board, played back", _on(_replay)),
    )
}


FLOAT_EMULATION = "simreal"


def get(name: str) -> Backend:
    """Return the backend of a name.

    Raises
    ------
    UsageError
        If there is no such backend; the message lists the backends.
    """
    name = str(name).replace("_", "-")  # nengo_loihi, as the package is imported
    if name == FLOAT_EMULATION:
        raise UsageError(
            "backend 'simreal': nengo-loihi's float emulation runs blocks that were not rounded, "
            "and an image holds integers only; choose 'reference' for float Nengo, or measure what "
            "rounding costs with `spikeport compile NETWORK --loss SECONDS`"
        )
    if name not in BACKENDS:
        raise unknown("backend", name, BACKENDS)
    return BACKENDS[name]
