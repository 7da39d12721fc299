"""Scales of decoded values, with which no read-out reaches its threshold."""

import nengo
import numpy as np
import pytest

from spikeport.compile.loihi.readout import MARGIN, readout_scale


def ensemble(**options: object) -> nengo.Ensemble:
    with nengo.Network():
        return nengo.Ensemble(3, 1, **options)


@pytest.mark.parametrize(
    ("options", "threshold"),
    [
        ({}, 10 * 0.001),  # nengo-loihi's threshold of neurons that do not spike
        ({"radius": 2.0}, 10 * 0.001 * 2),
        ({"neuron_type": nengo.LIF(amplitude=0.5)}, 10 * 0.001 / 0.5),
    ],
)
def test_the_worst_step_is_just_below_the_threshold(
    options: dict[str, object], threshold: float
) -> None:
    decoders = np.array([[1.0, -2.0, 0.5], [3.0, 1.0, 0.0]])
    scale = readout_scale(decoders, ensemble(**options), 0.001)
    # row 0: a sum of 2, largest weight 2; row 1: a sum of 4, largest weight 3, which decides
    np.testing.assert_allclose(scale, [2 * 4 / 3 * MARGIN / threshold, 4 * MARGIN / threshold])


def test_the_largest_scaled_weight_of_all_rows_is_the_same() -> None:
    decoders = np.random.RandomState(0).randn(4, 3) * [[1], [10], [0.1], [3]]
    scaled = decoders / readout_scale(decoders, ensemble(), 0.001)[:, np.newaxis]
    largest = np.abs(scaled).max(axis=1)
    np.testing.assert_allclose(largest, largest[0])
