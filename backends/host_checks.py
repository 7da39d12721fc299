"""Checks of the spikes and learning errors that a host sends with a step."""

from collections.abc import Mapping

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError


class HostChecks:
    """The sources of an image, the synapse groups that learn, and the sizes of their errors.

    Parameters
    ----------
    image : ChipImage
        The image.
    """

    def __init__(self, image: ChipImage) -> None:
        self._n_inputs, self._sizes = image.n_inputs, image.error_sizes

    def sources(self, spikes: np.ndarray) -> np.ndarray:
        """Return the sources that spike as a 64-bit array, which may be out of range.

        Raises
        ------
        BackendError
            The spikes are not a one-dimensional array of integers.
        """
        sources = np.asarray(spikes)
        if sources.size and (sources.ndim != 1 or sources.dtype.kind not in "iu"):
            raise BackendError(
                f"the host's spikes are {sources.dtype} of shape {sources.shape}; "
                "give the numbers of the sources that spike, as a (n,) array of integers"
            )
        return np.ascontiguousarray(sources, dtype=np.int64).ravel()

    def checked(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> np.ndarray:
        """Return the sources that spike, after all checks of spikes and errors.

        Raises
        ------
        BackendError
            The image has no such sources, or no such groups that learn.
        """
        sources = self.sources(spikes)
        self.check_range(sources)
        self.check_errors(errors)
        return sources

    def check_range(self, sources: np.ndarray) -> None:
        """Refuse sources that are not in the image, by BackendError."""
        if ((sources < 0) | (sources >= self._n_inputs)).any():
            raise out_of_range(sources, self._n_inputs)

    def check_errors(self, errors: Mapping[int, np.ndarray]) -> None:
        """Refuse errors of a group that does not learn, or of another shape, by BackendError."""
        for group, error in errors.items():
            if group not in self._sizes:
                known = ", ".join(map(str, self._sizes)) or "none"
                raise BackendError(f"synapse group {group} does not learn; those that do: {known}")
            expected = (self._sizes[group],)
            if np.shape(error) != expected:
                raise BackendError(
                    f"synapse group {group}: its error has shape {np.shape(error)}, not {expected}"
                )


def out_of_range(sources: np.ndarray, n_inputs: int) -> BackendError:
    """Return the error for sources of which at least one is not in the image."""
    return BackendError(
        f"the host sent {len(sources)} spikes of sources {sources.min()} to {sources.max()}, but "
        f"the image has only {n_inputs} sources, numbered from 0"
    )
