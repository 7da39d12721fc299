"""`Simulator`: a Nengo network on a chip, with the conventions of Nengo's own simulators."""

import functools
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import nengo
import numpy as np
from nengo.base import NengoObject
from nengo.exceptions import SimulatorClosed, ValidationError
from nengo.utils.progress import Progress, ProgressBar, ProgressTracker

from spikeport.backends import registry
from spikeport.backends.execution import Execution
from spikeport.backends.sampling import sampled
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.passes.pipeline import Pipeline
from spikeport.compile.pipeline import Compilation
from spikeport.constants import DT_S
from spikeport.errors import UsageError
from spikeport.hardware_models.activity import Activity


class DurationError(UsageError, ValidationError):
    """A simulation was asked to run backwards; Nengo's `ValidationError` too."""

    __str__ = Exception.__str__  # Nengo's puts the parameter's name in front

    def __init__(self, duration: str, parameter: str) -> None:
        super().__init__(f"a simulation runs forwards: {duration} were asked for", parameter)


class Simulator:
    """Runs a network on a backend, host and chip in lock-step.

    Parameters
    ----------
    network : nengo.Network
        The network.
    chip : str or Path
        The chip it is compiled for: a name, or the path of a TOML file.
    backend : str
        ``"native"``, ``"nengo-loihi"`` for its emulator (the same bits, slower), or
        ``"reference"`` for float Nengo without a chip.
    dt : float
        The time step, in seconds.
    seed : int, optional
        Seed of noise and processes; by default the network's seed + 1.
    progress_bar : bool or nengo.utils.progress.ProgressBar
        How runs show their progress; by default they do not.
    pipeline : Pipeline or str, optional
        The passes of the compile; by default the chip's.

    Attributes
    ----------
    compilation : Compilation or None
        Image, report and host side; None on the reference backend, and where no ensemble is meant
        for the chip, so that all of the network runs on the host.
    data : mapping of nengo.Probe to (n_steps, size) array
        What the probes recorded; ``data[ensemble]`` and ``data[connection]`` hold what Nengo built.

    Raises
    ------
    DoesNotFitError, CompileError
        If the network cannot be put on the chip.
    UsageError
        If chip or backend is not known.
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
    ) -> None:
        source = registry.Source(network, chip, dt, pipeline)
        self._open = functools.partial(registry.get(backend).open, source)
        self._probes = network.all_probes
        self.seed = (network.seed or 0) + 1 if seed is None else seed
        self.dt = dt
        self.progress_bar = progress_bar
        self._start(compilation=None)
        self.closed = False

    def _start(self, compilation: Compilation | None) -> None:
        self.n_steps = 0
        self._execution = self._open(self.seed, compilation)
        self.compilation = self._execution.compilation
        self.data = _Data(self._probes, self._execution)

    def __del__(self) -> None:
        """Warn of a simulator that nobody closed, as Nengo does."""
        if not self.closed:
            message = "Simulator was deallocated while open; close it, or use it in a with block"
            warnings.warn(message, ResourceWarning, stacklevel=2, source=self)

    def __enter__(self) -> "Simulator":
        if self.closed:
            raise SimulatorClosed("Cannot re-open after simulator is closed.")
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def image(self) -> ChipImage | None:
        """The chip image; None where nothing is compiled for a chip."""
        return None if self.compilation is None else self.compilation.image

    @property
    def time(self) -> float:
        """Simulated time so far, in seconds."""
        return self.n_steps * self.dt

    @property
    def activity(self) -> Activity:
        """Exact counts of all steps so far."""
        return self._execution.activity()

    def report(self) -> dict[str, Any]:
        """What the compiled network takes, with energy and time where steps were run."""
        if self.compilation is None:
            raise UsageError("nothing of the network is compiled for a chip: there is no report")
        return self.compilation.report.to_dict(self.activity if self.n_steps else None)

    def step(self) -> None:
        """Advance by one step."""
        if self.closed:
            raise SimulatorClosed("Simulator cannot run because it is closed.")
        self._execution.step()
        self.n_steps += 1

    def run_steps(self, steps: int, progress_bar: bool | ProgressBar | None = None) -> None:
        """Advance by a number of steps; ``progress_bar`` replaces the simulator's."""
        if steps < 0:
            raise DurationError(f"{steps} steps", "steps")
        if steps == 0:
            return
        shown = self.progress_bar if progress_bar is None else progress_bar
        with ProgressTracker(shown, Progress("Simulating", "Simulation", steps)) as tracker:
            for _ in range(steps):
                self.step()
                tracker.total_progress.step()

    def run(self, time_in_seconds: float, progress_bar: bool | ProgressBar | None = None) -> None:
        """Advance by a time, rounded to whole steps; see `run_steps`."""
        if time_in_seconds < 0:
            raise DurationError(f"{time_in_seconds:g} s", "time_in_seconds")
        steps = round(time_in_seconds / self.dt)
        if steps == 0:
            warnings.warn(f"{time_in_seconds:g} s is no step of {self.dt:g} s", stacklevel=2)
        self.run_steps(steps, progress_bar)

    def trange(self, sample_every: float | None = None) -> np.ndarray:
        """The times, in seconds, of the steps so far, or of those sampled every so often."""
        return self.dt * sampled(self.n_steps, sample_every, self.dt)

    def clear_probes(self) -> None:
        """Forget what the probes recorded so far."""
        self._execution.clear_probes()

    def reset(self, seed: int | None = None) -> None:
        """Start over: all state at rest, nothing recorded; the compiled network stays as it is.

        Parameters
        ----------
        seed : int, optional
            A new seed of noise and processes; by default that of before.

        Raises
        ------
        SimulatorClosed
            If the simulator is closed.
        """
        if self.closed:
            raise SimulatorClosed("Cannot reset closed Simulator.")
        self._execution.close()
        self.seed = self.seed if seed is None else seed
        self._start(self.compilation)

    def close(self) -> None:
        """Free what the simulation holds; recorded data stays readable."""
        if not self.closed:
            self.data.freeze()
            self._execution.close()
            self.closed = True


class _Data(Mapping[NengoObject, Any]):
    """Recorded data by probe; what Nengo built, by ensemble or connection."""

    def __init__(self, probes: list[nengo.Probe], execution: Execution) -> None:
        self._probes = probes
        self._execution = execution
        self._frozen: dict[nengo.Probe, np.ndarray] = {}

    def __getitem__(self, key: NengoObject) -> Any:
        if key not in self._probes:
            return self._execution.built(key)
        return self._frozen[key] if self._frozen else self._execution.data(key)

    def __iter__(self) -> Iterator[nengo.Probe]:
        return iter(self._probes)

    def __len__(self) -> int:
        return len(self._probes)

    def freeze(self) -> None:
        self._frozen = {probe: self._execution.data(probe) for probe in self._probes}
