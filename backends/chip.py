"""The narrow protocol of everything an image runs on: an emulator, a board, a recording."""

from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol, TypeAlias, runtime_checkable

import numpy as np

from spikeport.hardware_models.activity import Activity

CLOSED = "the chip is closed: it cannot step any more"


class Chip(Protocol):
    """An image, loaded and at rest.

    A chip starts with all state at zero. `step` advances it by one time step.
    """

    @property
    def link(self) -> dict[str, object] | None:
        """The figures of the link to a board, for JSON; None without a link."""

    def step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> list[np.ndarray]:
        """Advance by one step.

        Parameters
        ----------
        spikes : (n,) int array
            The sources that spike on the host in this step, numbered through all inputs of the
            image, one after the other; a source listed twice spikes twice. The spikes reach the
            chip's synapses in the next step.
        errors : mapping of int to (d,) float array
            Learning errors of this step by the number of a synapse group; 0 for other groups.

        Returns
        -------
        outputs : list of (n,) arrays
            For each output of the image, the state of its compartments after the step, in the
            chip's integers (a spike is 1), before decoding weights; valid until the next step.
        """

    def activity(self) -> Activity:
        """Return exact counts of all steps so far."""

    def close(self) -> None:
        """Free the chip's resources; it cannot step any more."""


class Decoding(NamedTuple):
    """Tables that decode values from the states of all outputs of an image, laid end to end."""

    start: np.ndarray
    """Start of each value's entries, (n_values + 1,); only a 0 where sums have too many terms."""
    indices: np.ndarray
    """Index of each entry in the states of all outputs."""
    weights: np.ndarray


Joined: TypeAlias = Callable[[], tuple[list[np.ndarray], bool]]
"""A step of a chip on its host's memory: returns the outputs, and True if all are decoded."""


@runtime_checkable
class Joinable(Protocol):
    """A chip that takes its host's spikes from memory and decodes its outputs, in one call."""

    def join(self, sources: np.ndarray, decoding: Decoding, inbox: np.ndarray) -> Joined | None:
        """Return a step on the host's memory, or None, as for a chip that learns and needs errors.

        Parameters
        ----------
        sources : (n_inputs,) float array
            The host's sources; a source spikes if its value is not 0.
        decoding : Decoding
            The decoding of the outputs.
        inbox : (n_values,) float array
            The array that decoded values are written to.
        """
