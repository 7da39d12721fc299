"""The compartments of an image that are read out, and must not spike."""

import numpy as np

from spikeport.compile.image import ChipImage


def readout_compartments(image: ChipImage) -> np.ndarray:
    """Compartments whose voltage is an output: they must never reach their threshold."""
    reads = [
        image["output_compartment"][image.part("output_start", i)]
        for i, output in enumerate(image.manifest["outputs"])
        if output["key"] == "voltage" and output["weights"] == "matrix"
    ]
    return np.unique(np.concatenate(reads)) if reads else np.zeros(0, dtype=int)
