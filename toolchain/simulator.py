"""`Simulator`: a Nengo network on a chip, with the conventions of Nengo's own simulators."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import nengo
import numpy as np
from nengo.exceptions import SimulatorClosed

from spikeport.backends import registry
from spikeport.backends.execution import Execution
from spikeport.compile.image import ChipImage
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
        What the probes recorded.

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
        found = registry.get(backend)
        self.seed = (network.seed or 0) + 1 if seed is None else seed
        self.dt = dt
        self.n_steps = 0
        self.closed = False
        self._execution = found.open(network, chip, dt, self.seed)
        self.compilation = self._execution.compilation
        self.data = _Data(network, self._execution)

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

    def trange(self) -> np.ndarray:
        """(n_steps,) the times of the steps so far, in seconds."""
        return self.dt * np.arange(1, self.n_steps + 1)

    def close(self) -> None:
        """Free what the simulation holds; recorded data stays readable."""
        if not self.closed:
            self.data.freeze()
            self._execution.close()
            self.closed = True


class _Data(Mapping[nengo.Probe, np.ndarray]):
    """Recorded data by probe."""

    def __init__(self, network: nengo.Network, execution: Execution) -> None:
        self._probes = network.all_probes
        self._execution = execution
        self._frozen: dict[nengo.Probe, np.ndarray] = {}

    def __getitem__(self, probe: nengo.Probe) -> np.ndarray:
        return self._frozen[probe] if self._frozen else self._execution.data(probe)

    def __iter__(self) -> Iterator[nengo.Probe]:
        return iter(self._probes)

    def __len__(self) -> int:
        return len(self._probes)

    def freeze(self) -> None:
        self._frozen = {probe: self._execution.data(probe) for probe in self._probes}
