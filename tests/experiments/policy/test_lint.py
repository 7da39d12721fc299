"""Hints on a conversion, each with a cure."""

from dataclasses import replace

import pytest

from spikeport.experiments.policy.lint import ACTION_S, FEW, WIDE, ConversionLint, LayerLint

FINE = LayerLint("layer 0", 8, 1.0, 1.0, WIDE, 50.0, FEW, 0.002, 0.1)


def hints(*layers, delay_s=ACTION_S):
    return list(ConversionLint(layers, 0.1, 0.1, delay_s).hints())


def test_figures_at_their_bounds_give_no_hint():
    assert hints(FINE) == []


@pytest.mark.parametrize(
    ("change", "hint"),
    [
        ({"spread": 6.25}, "range too wide: layer 0 (6.2 x rms); cure: record observations"),
        (
            {"spikes": 0.25},
            "rate too low: layer 0 (0.25 spikes within one tau); cure: more neurons (--neurons)",
        ),
    ],
)
def test_a_layer_with_a_wide_range_or_a_low_rate_is_named_with_a_cure(change, hint):
    (found,) = hints(replace(FINE, **change))
    assert found.startswith(hint)


def test_layers_with_the_same_problem_share_a_hint():
    wide = replace(FINE, spread=10.0)
    (found,) = hints(wide, FINE, replace(wide, name="layer 2"))
    assert found.startswith("range too wide: layer 0 (10.0 x rms), layer 2 (10.0 x rms); cure: ")


def test_filters_longer_than_an_action_give_a_hint():
    (found,) = hints(FINE, delay_s=0.025)
    assert found == (
        "tau too long: 25 ms in total, but an action lasts 20 ms; cure: a smaller --tau-fwd"
    )
