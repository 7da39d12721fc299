"""`Simulator`: a Nengo network on a chip, with the conventions of Nengo's own simulators."""

import functools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import nengo
import numpy as np
from nengo.exceptions import SimulatorClosed

from spikeport.backends import registry
from spikeport.backends.execution import Execution
from spikeport.backends.sampling import sampled
from spikeport.compile.image import ChipImage
from spikeport.compile.pipeline import Compilation
from spikeport.errors import UsageError
from spikeport.hardware_models.activity import Activity


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

    Attributes
    ----------
    compilation : Compilation or None
        Image, report and host side; None on the reference backend.
    data : mapping of nengo.Probe to (n_steps, size) array
        What the probes recorded; ``data[ensemble]`` and ``data[connection]`` hold what Nengo built.

    Raises
    ------
    DoesNotFitError, CompileError
        If the network cannot be put on the chip.
    UsageError
        If chip or backend is not known.
    """

    def __init__(
        self,
        network: nengo.Network,
        chip: str | Path = "loihi",
        backend: str = "native",
        dt: float = 0.001,
        seed: int | None = None,
    ) -> None:
        self._open = functools.partial(registry.get(backend).open, network, chip, dt)
        self._probes = network.all_probes
        self.seed = (network.seed or 0) + 1 if seed is None else seed
        self.dt = dt
        self.closed = False
        self._start(compilation=None)

    def _start(self, compilation: Compilation | None) -> None:
        self.n_steps = 0
        self._execution = self._open(self.seed, compilation)
        self.compilation = self._execution.compilation
        self.data = _Data(self._probes, self._execution)

    def __enter__(self) -> "Simulator":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def image(self) -> ChipImage | None:
        """The chip image; None on the reference backend."""
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
            raise UsageError("the reference backend compiles nothing: there is no report")
        return self.compilation.report.to_dict(self.activity if self.n_steps else None)

    def step(self) -> None:
        """Advance by one step."""
        if self.closed:
            raise SimulatorClosed("Simulator cannot run because it is closed.")
        self._execution.step()
        self.n_steps += 1

    def run_steps(self, steps: int) -> None:
        """Advance by a number of steps."""
        if steps < 0:
            raise UsageError(f"a simulation runs forwards: {steps} steps were asked for")
        for _ in range(steps):
            self.step()

    def run(self, time_in_seconds: float) -> None:
        """Advance by a time, rounded to whole steps."""
        self.run_steps(round(time_in_seconds / self.dt))

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


class _Data(Mapping[Any, Any]):
    """Recorded data by probe; what Nengo built, by ensemble or connection."""

    def __init__(self, probes: list[nengo.Probe], execution: Execution) -> None:
        self._probes = probes
        self._execution = execution
        self._frozen: dict[nengo.Probe, np.ndarray] = {}

    def __getitem__(self, key: Any) -> Any:
        if key not in self._probes:
            return self._execution.built(key)
        return self._frozen[key] if self._frozen else self._execution.data(key)

    def __iter__(self) -> Iterator[nengo.Probe]:
        return iter(self._probes)

    def __len__(self) -> int:
        return len(self._probes)

    def freeze(self) -> None:
        self._frozen = {probe: self._execution.data(probe) for probe in self._probes}
