"""Causes of loss, and the hints that follow."""

import json
from dataclasses import replace

import pytest

from spikeport.compile.check.lost_values import SATURATED
from spikeport.compile.report.loss import ALIASED, Loss, LossPart

NONE = Loss(
    n_steps=2000,
    tau_s=0.02,
    network_error=0.2,
    output_error=0.1,
    floor=0.01,
    parts=(LossPart("a", "weights", 0.01, 0.1, 1.0),),
    aliasing={"a": ALIASED},
    readout_spikes=0,
    saturated_inputs={"x": SATURATED},
)


@pytest.mark.parametrize(
    ("change", "hint"),
    [
        ({"readout_spikes": 1234}, ("SP406", "read-outs", "1,234 spikes in 2,000 steps")),
        ({"aliasing": {"a": 0.1, "b": 0.26}}, ("SP407", "b", "26 % off")),
        (
            {"saturated_inputs": {"x": 0.5, "y": 0}},
            ("SP408", "x", "spikes lost in 50 % of steps"),
        ),
    ],
)
def test_a_cause_of_loss_above_its_bound_gives_a_hint(
    change: dict[str, object], hint: tuple[str, str, str]
) -> None:
    (found,) = replace(NONE, **change).hints
    assert (found.id, found.object, found.used) == hint


def test_a_cause_of_loss_at_its_bound_gives_no_hint() -> None:
    assert NONE.hints == ()


def test_a_loss_as_plain_data_survives_json() -> None:
    plain = NONE.to_dict()
    assert json.loads(json.dumps(plain)) == plain
    assert plain["parts"] == [
        {
            "object": "a",
            "what": "weights",
            "rounding": 0.01,
            "output_error": 0.1,
            "share": 1.0,
        }
    ]


def test_every_hint_on_a_loss_has_a_cure() -> None:
    several = replace(
        NONE,
        n_steps=10,
        aliasing={"a": 0.5, "b": 0.25},
        readout_spikes=3,
        saturated_inputs={"input 0": 0.5},
    )
    assert [str(hint) for hint in several.hints] == [
        "read-outs: SP406 read-out saturation: 3 spikes in 10 steps, limit 0; cure: divide what is "
        "decoded by its full scale, or by more, and multiply on the host",
        "a: SP407 rate aliasing: 50 % off; cure: lower the maximum rates, or, from Python, take a "
        "shorter dt: Simulator(network, dt=0.0005)",
        "input 0: SP408 input saturation: spikes lost in 50 % of steps; cure: widen the ensemble's "
        "radius beyond the input's largest value, or scale the input down, or, if inputs of "
        "opposite signs cancel, compile with `-p compact`, which sends their sum; what is sent "
        "into neurons is cut off at 1, whatever the radius: scale it down, and its transform up",
    ]
