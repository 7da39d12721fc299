"""`Simulator`: a Nengo network on a chip, with the conventions of Nengo's own simulators."""

import functools
import os
import sys
import threading
import warnings
from collections.abc import Iterator, Mapping
from numbers import Integral, Real
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Any, NoReturn

import nengo
import numpy as np
from nengo.base import NengoObject
from nengo.exceptions import SimulatorClosed
from nengo.utils.progress import Progress as Steps
from nengo.utils.progress import ProgressBar, ProgressTracker

from spikeport import migration
from spikeport.atomic import check_folder
from spikeport.backends import registry
from spikeport.backends.board.link import OWN_STUB, LinkOptions
from spikeport.backends.execution import Execution
from spikeport.backends.sampling import sampled
from spikeport.backends.step_log import MESSAGES, counts_files
from spikeport.cache import NOTHING, Cache
from spikeport.compile.check.lost_values import lost_values
from spikeport.compile.check.violation import Violation, hint_lines
from spikeport.compile.ground.refusal import ArgumentError, without_addresses
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.passes.pipeline import Pipeline
from spikeport.compile.pipeline import check_arguments
from spikeport.constants import DT_S, LARGEST_SEED, LONGEST_RUN
from spikeport.errors import BackendError, BoardLostError, UsageError
from spikeport.hardware_models.activity import Activity
from spikeport.interrupts import interrupts_deferred
from spikeport.progress import Progress, silent

if TYPE_CHECKING:
    from nengo_loihi.builder import Model


class Simulator:
    """Simulator of a network on a backend, host and chip in lock-step.

    Parameters
    ----------
    network : nengo.Network
        The network.
    chip : str or Path
        The chip it is compiled for: a name, or the path of a TOML file.
    backend : str
        ``"native"``, ``"native-threads"`` for the native one on all processors, ``"nengo-loihi"``
        for its emulator (the same bits, slower), ``"board"`` for a board or its stub, ``"replay"``
        for the record of a board, or ``"reference"`` for float Nengo without a chip.
    dt : float
        The time step, in seconds.
    seed : int, optional
        Seed of noise and processes; by default the network's seed + 1. A network without a seed
        counts as one with seed 0, so that its runs are equal; Nengo would draw a seed.
    progress_bar : bool or nengo.utils.progress.ProgressBar
        The progress bar of runs; by default none.
    pipeline : Pipeline or str, optional
        The passes of the compile; by default the chip's.
    counts : str or Path, optional
        A folder for the counts of every step, see `spikeport.backends.step_log.StepLog`; without
        it `activity` keeps the last steps one by one, and folds earlier steps into the sums that
        energy and time depend on.
    offload : bool
        Move ensembles that break a rule of the chip to the host, until the rest compiles; the
        report lists them as ``offloaded``.
    target, precompute, remove_passthrough, model, hardware_options
        The arguments of `nengo_loihi.Simulator`: ``"sim"`` is any backend with a chip,
        ``precompute`` changes nothing, settings of the build are taken from ``model``, such as
        ``pes_error_scale``, and options of boards are refused. See docs/migrating.md.
    progress : callable
        Called when a stage of the compile begins, see `spikeport.progress.Progress`.
    link : LinkOptions, optional
        The link to a board, for the backends ``"board"`` and ``"replay"``; by default a board's
        stub in simulated time.
    cache : Cache
        The cache of compiles, e.g. `spikeport.cache.of_user()`; by default none.

    Attributes
    ----------
    network : nengo.Network
        The network, as passed in.
    compilation : Compilation or None
        Image, report and host side; None on the reference backend, and if no ensemble is on the
        chip, so that the whole network runs on the host.
    data : mapping of nengo.Probe to (n_steps, size) array
        Recordings of the probes, read-only; ``data[ensemble]`` and ``data[connection]`` hold the
        built parameters, in Nengo's units. The weights of a connection are the product of transform
        and decoders, which are solved again when they are first read; weights of a solver with
        ``weights=True`` include the encoders, too, unless passes rewrote the network.

    Raises
    ------
    DoesNotFitError, CompileError
        If the network cannot be put on the chip.
    UsageError
        If an argument is not valid, or chip or backend is not known.
    """

    closed = True  # until it is built

    def __init__(
        self,
        network: nengo.Network,
        chip: str | Path = "loihi",
        backend: str = "native",
        dt: float = DT_S,
        seed: int | None = None,
        progress_bar: bool | ProgressBar = False,
        pipeline: Pipeline | str | None = None,
        counts: str | Path | None = None,
        offload: bool = False,
        *,
        target: str | None = None,
        precompute: bool | None = None,
        remove_passthrough: bool = True,
        model: "Model | None" = None,
        hardware_options: Mapping[str, object] | None = None,
        progress: Progress = silent,
        link: LinkOptions = OWN_STUB,
        cache: Cache = NOTHING,
    ) -> None:
        # Refuse bad arguments first: the build may take minutes.
        check_arguments(network, chip, dt, pipeline)
        dt = float(dt)
        migration.check_target(target, backend)
        migration.check_precompute(precompute)
        migration.check_hardware_options(hardware_options)
        self.seed = _own_seed(seed, network)
        _check_kinds(progress_bar, offload, cache, link, counts)
        source = registry.Source(
            network=network,
            chip=chip,
            dt_s=dt,
            pipeline=pipeline,
            counts=_counts_folder(counts),
            offload=offload,
            settings=migration.build_settings(model, dt, remove_passthrough),
            progress=progress,
            link=link,
            cache=cache,
        )
        self._open = functools.partial(registry.get(backend).open, source)
        _check_link(link, backend)
        self.network = network
        self._dt = dt
        self.progress_bar = progress_bar
        self.data = _Data(network.all_probes)
        self._start(earlier=None)
        self.closed = False

    def _start(self, earlier: Execution | None) -> None:
        self._execution = self._open(self.seed, earlier)
        self._n_steps = 0
        # No thread waits for this lock: it marks a step that is under way, or was broken off.
        self._stepping = threading.Lock()
        self.compilation = self._execution.compilation
        self.data.begin(self._execution)

    def __del__(self) -> None:
        """Warn of a simulator that nobody closed, as Nengo does."""
        if not self.closed:
            message = "Simulator was deallocated while open; close it, or use it in a with block"
            warnings.warn(message, ResourceWarning, stacklevel=2, source=self)

    def __reduce__(self) -> NoReturn:
        """Refuse to be pickled: kernels and host functions have no form on disk."""
        raise TypeError(
            "a Simulator cannot be pickled; save its image with sim.image.save(), or build the "
            "simulator in the process that runs it"
        )

    def __enter__(self) -> "Simulator":
        if self.closed:
            raise SimulatorClosed("Cannot re-open after simulator is closed.")
        return self

    def __exit__(self, *_: object) -> None:
        self._close()

    @property
    def image(self) -> ChipImage | None:
        """The chip image; None if nothing is compiled for a chip."""
        return None if self.compilation is None else self.compilation.image

    @property
    def dt(self) -> float:
        """The time step, in seconds."""
        return self._dt

    @property
    def n_steps(self) -> int:
        """The number of steps so far."""
        return self._n_steps

    @property
    def time(self) -> float:
        """Simulated time so far, in seconds."""
        return self.n_steps * self.dt

    @property
    def activity(self) -> Activity:
        """Exact counts of all steps so far; early steps of long runs are folded into sums."""
        return self._execution.activity()

    @property
    def link(self) -> dict[str, object] | None:
        """Round trips, held steps and faults of the link to a board; None without a board."""
        return self._execution.link

    def report(self) -> dict[str, Any]:
        """Return the report of the compile, with energy and time if steps were run.

        Raises
        ------
        UsageError
            If nothing of the network is on the chip.
        """
        if self.compilation is None:
            raise UsageError("nothing of the network is compiled for a chip: there is no report")
        return self.compilation.report.to_dict(self.activity if self.n_steps else None)

    def step(self) -> None:
        """Advance by one step.

        Raises
        ------
        SimulatorClosed
            If the simulator is closed.
        BackendError
            If an earlier step was broken off by an error or an interrupt, or another thread is in
            one: host and chip are not at the same step. `reset` starts over.
        """
        if self.closed:
            raise SimulatorClosed("Simulator cannot run because it is closed.")
        if not self._stepping.acquire(blocking=False):
            raise BackendError(
                f"step {self.n_steps + 1} was broken off, or another thread is in it, so that host "
                "and chip are not at the same step; reset() the simulator, or keep to one thread"
            )
        self._execution.step()
        self._n_steps += 1
        self._stepping.release()  # not after an error: a step that was broken off is not repeated

    def run_steps(self, steps: int, progress_bar: bool | ProgressBar | None = None) -> None:
        """Advance by a number of steps; ``progress_bar`` replaces the simulator's.

        Ctrl-C ends the run after the current step, so that another run can go on from there. A
        second Ctrl-C ends it at once.

        Raises
        ------
        ArgumentError
            If an argument is not valid; nothing was run.
        SimulatorClosed, BackendError
            As `step`.
        """
        if not isinstance(steps, Integral) or not 0 <= steps <= LONGEST_RUN:
            raise ArgumentError("steps", steps, f"an integer from 0 to {LONGEST_RUN:,}")
        _check_progress_bar(progress_bar)
        if steps == 0:
            return
        bar = self.progress_bar if progress_bar is None else progress_bar
        with (
            interrupts_deferred() as check_interrupt,
            ProgressTracker(bar, Steps("Simulating", "Simulation", steps)) as tracker,
        ):
            for _ in range(steps):
                self.step()
                tracker.total_progress.step()
                check_interrupt()

    def run(self, time_in_seconds: float, progress_bar: bool | ProgressBar | None = None) -> None:
        """Advance by a time in seconds, rounded to whole steps; raises as `run_steps`."""
        longest_s = LONGEST_RUN * self.dt
        if not isinstance(time_in_seconds, Real) or not 0 <= time_in_seconds <= longest_s:
            expected = f"a time in seconds from 0 to {longest_s:g}"
            raise ArgumentError("time_in_seconds", time_in_seconds, expected)
        steps = round(time_in_seconds / self.dt)
        if steps == 0:
            rounded = f"{time_in_seconds:g} s rounds to zero steps of {self.dt:g} s"
            warnings.warn(f"{rounded}; nothing was run", stacklevel=2)
        self.run_steps(steps, progress_bar)

    def trange(self, sample_every: float | None = None, *, dt: None = None) -> np.ndarray:
        """Return the times, (n,), in seconds, of the steps so far, or of every sample.

        Raises
        ------
        ArgumentError
            If ``sample_every`` is neither None nor a time in seconds above 0.
        UsageError
            If ``dt`` is set: it is nengo-loihi's name for ``sample_every``.
        """
        migration.check_sample_times(dt)
        if not (sample_every is None or _is_time(sample_every)):
            raise ArgumentError("sample_every", sample_every, "None, or a time in seconds above 0")
        return self.dt * sampled(self.n_steps, sample_every, self.dt)

    def clear_probes(self) -> None:
        """Delete the data that the probes recorded so far."""
        self._execution.clear_probes()
        if self.closed:
            self.data.freeze()

    def reset(self, seed: int | None = None) -> None:
        """Start over: all state at rest, nothing recorded; the compiled network stays as it is.

        Files of ``counts`` and of ``link.record`` begin anew as well.

        Parameters
        ----------
        seed : int, optional
            A new seed of noise and processes; by default the seed stays.

        Raises
        ------
        SimulatorClosed
            If the simulator is closed.
        UsageError
            If the seed is neither None nor an integer from 0 to `LARGEST_SEED`; the simulation goes
            on as it was.
        """
        if self.closed:
            raise SimulatorClosed("Cannot reset closed Simulator.")
        _check_seed(seed)
        # If the chip cannot be opened again, the simulator stays closed, with its data.
        self._close()
        self.seed = self.seed if seed is None else seed
        self._start(self._execution)
        self.closed = False

    def close(self) -> None:
        """Free the simulation's resources; recorded data stays readable."""
        self._close()

    def _close(self) -> None:
        """Close for a method that a user calls: warnings name the line of the user's."""
        if not self.closed:
            self.closed = True
            try:
                self.data.freeze()
            finally:  # a synapse of the user's may fail, or memory may not suffice
                self._execution.close()
            for line in hint_lines(self._lost_values()):
                warnings.warn(line, stacklevel=3)

    def _lost_values(self) -> list[Violation]:
        """Return the hints on values that read-outs and inputs lost, if any."""
        # The run that was recorded has warned, and to count a record that was cut off takes long.
        is_replay = self.link is not None and "replays" in self.link
        if self.compilation is None or is_replay or not self.n_steps:
            return []
        try:
            return [*lost_values(self.activity)]
        except BoardLostError:  # it has left no counts, or is a forked process' parent's
            return []


def _is_time(value: float) -> bool:
    return isinstance(value, Real) and 0 < value <= sys.float_info.max


def _check_seed(seed: int | None) -> None:
    if not (seed is None or (isinstance(seed, Integral) and 0 <= seed <= LARGEST_SEED)):
        raise ArgumentError("seed", seed, f"None, or an integer from 0 to {LARGEST_SEED}")


def _own_seed(seed: int | None, network: nengo.Network) -> int:
    """Return the seed of a simulator; ArgumentError if it is not valid."""
    _check_seed(seed)
    if seed is not None:
        return seed
    if network.seed == LARGEST_SEED:
        # By default the simulator's seed is the network's plus 1, which would be too large.
        raise ArgumentError("network.seed", network.seed, "a smaller one, or Simulator(seed=)")
    # Nengo's rule, with 0 for a missing seed.
    return (network.seed or 0) + 1


def _check_link(link: LinkOptions, backend: str) -> None:
    """Refuse options of a link that would do nothing; UsageError."""
    if idle := link.idle(backend):
        other = "replay" if idle == ("replay",) else "board"
        raise UsageError(
            f"link: LinkOptions({idle[0]}={getattr(link, idle[0])!r}) does nothing on backend "
            f"'{backend}'; cure: leave it out, or backend=\"{other}\""
        )


def _check_kinds(
    progress_bar: object, offload: object, cache: object, link: object, counts: object
) -> None:
    """Raise ArgumentError for an argument of a wrong type."""
    _check_progress_bar(progress_bar)
    _check_kind("offload", offload, bool, "a bool")
    _check_kind("cache", cache, Cache, "a spikeport.cache.Cache")
    _check_kind("link", link, LinkOptions, "a spikeport.backends.board.link.LinkOptions")
    _check_kind("counts", counts, (str, Path, NoneType), "None, or the path of a folder")


def _check_progress_bar(bar: object) -> None:
    if bar is not None:
        _check_kind("progress_bar", bar, (bool, ProgressBar), "a bool, or a ProgressBar of Nengo's")


def _check_kind(name: str, value: object, kind: type | tuple[type, ...], in_words: str) -> None:
    if not isinstance(value, kind):
        raise ArgumentError(name, value, in_words)


def _counts_folder(folder: str | Path | None) -> Path | None:
    """Return the folder for counts; UsageError if it is not writable, or holds a run's counts."""
    if folder is None:
        return None
    check_folder("counts", Path(folder), Path(folder))
    if counts_files(Path(folder)) or os.path.lexists(Path(folder) / MESSAGES):
        raise UsageError(f"{folder}: holds the counts of another run; choose another folder")
    return Path(folder)


class _Data(Mapping[NengoObject, Any]):
    """Recorded data by probe, and built parameters by ensemble or connection."""

    def __init__(self, probes: list[nengo.Probe]) -> None:
        self._probes = probes

    def begin(self, execution: Execution) -> None:
        """Take the data from an execution; a simulator that is reset has a new one."""
        self._execution = execution
        self._frozen: dict[nengo.Probe, np.ndarray] = {}

    def __getitem__(self, key: NengoObject) -> Any:
        if key in self._probes:
            found = (self._frozen[key] if self._frozen else self._execution.data(key)).view()
            found.setflags(write=False)  # it may be a copy, in which a change would be lost
            return found
        try:
            return self._execution.built(key)
        except KeyError:
            on_host = (
                ". A connection from an ensemble on the host to a part of one on the chip has no "
                "values either"
            )
            raise KeyError(
                f"{without_addresses(str(key))}: no probe, ensemble or connection of the network, "
                "or one that passes replaced; for those, use pipeline='as_written'"
                f"{on_host if isinstance(key, nengo.Connection) else ''}"
            ) from None

    def __iter__(self) -> Iterator[nengo.Probe]:
        return iter(self._probes)

    def __len__(self) -> int:
        return len(self._probes)

    def freeze(self) -> None:
        self._frozen = {probe: self._execution.data(probe) for probe in self._probes}
