"""The narrow protocol of everything an image runs on: an emulator, a board, a recording."""

from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol, TypeAlias, runtime_checkable

import numpy as np

from spikeport.hardware_models.activity import Activity


class Chip(Protocol):
    """An image, loaded and at rest.

    A chip starts with all state at zero. `step` advances it by one time step.
    """

    @property
    def link(self) -> dict[str, object] | None:
        """The figures of the link to a board, for JSON; None where there is none."""

    def step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> list[np.ndarray]:
        """Advance by one step.

        Parameters
        ----------
        spikes : (n,) int array
            The sources that spike on the host in this step, counted through all inputs of the
            image, one after the other; one that is there twice spikes twice. They reach the chip's
            synapses in the next step.
        errors : mapping of int to (d,) float array
            Learning errors by number of synapse group, in effect from this step on.

        Returns
        -------
        outputs : list of (n,) arrays
            For each output of the image, what its compartments hold after the step, in the chip's
            integers (a spike as 1), before decoding weights; valid until the next step.
        """

    def activity(self) -> Activity:
        """Return exact counts of all steps so far."""

    def close(self) -> None:
        """Free what the chip holds; it cannot step any more."""


class Decoding(NamedTuple):
    """Tables of how values are decoded from what all outputs of an image hold, end to end."""

    start: np.ndarray
    """Start of each value among the entries, (n_values + 1,); none where sums are too long."""
    held: np.ndarray
    """Number of each entry among the values that are held."""
    weights: np.ndarray


Joined: TypeAlias = Callable[[], tuple[list[np.ndarray], bool]]
"""A step of a chip on its host's memory; it returns the outputs, and whether all are decoded."""


@runtime_checkable
class Joinable(Protocol):
    """A chip that takes its host's spikes from memory and decodes its outputs, in one call."""

    def join(self, sources: np.ndarray, decoding: Decoding, inbox: np.ndarray) -> Joined | None:
        """Return such a step; None where the chip learns, and needs errors.

        Parameters
        ----------
        sources : (n_inputs,) float array
            The host's sources: those that are not 0 spike.
        decoding : Decoding
            The decoding of the outputs.
        inbox : (n_values,) float array
            The array that decoded values are written to.
        """
