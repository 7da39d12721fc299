"""A report with every part that a report can have."""

from typing import Any

import pytest

from spikeport.compile.image.expected import Rates, expected_activity
from spikeport.compile.pipeline import Compilation
from spikeport.compile.report.loss import Loss, LossPart

LOSS = Loss(
    n_steps=10,
    tau_s=0.02,
    network_error=None,
    output_error=0.5,
    floor=0.0,
    parts=(LossPart("a", "bias", 0.1, 0.5, 1.0),),
    aliasing={"a": 0.5, "b": 0.25},
    readout_spikes=3,
    saturated_inputs={"input 0": 0.5},
)


@pytest.fixture
def whole(compiled_chain: Compilation) -> dict[str, Any]:
    """Return a report with every part that a report can have."""
    rates = Rates(100, {"first": 50})
    activity = expected_activity(compiled_chain.image, rates)
    return compiled_chain.report.to_dict(activity, rates, LOSS.to_dict())
