"""A check of the learning errors that a host sends with a step."""

from collections.abc import Mapping

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError


class LearningErrors:
    """The synapse groups of an image that learn, and the sizes of their errors.

    Each value is learned by two weights of an axon, one for either sign, and has one error: a group
    takes half as many errors as an axon has weights.

    Parameters
    ----------
    image : ChipImage
        The image.
    """

    def __init__(self, image: ChipImage) -> None:
        learning = np.flatnonzero(image.learns)
        rows = image.groups.row_start[learning]
        sizes = (image.rows.start[rows + 1] - image.rows.start[rows]) // 2
        self._sizes = dict(zip(learning.tolist(), sizes.tolist(), strict=True))

    def check(self, errors: Mapping[int, np.ndarray]) -> None:
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
