"""Conventional computers beside a chip, against values by hand."""

import itertools

import pytest

from spikeport.hardware_models.computers import Computer, OnChip, break_even, built_in

CHIP = OnChip(1000, 2e-12, 1e-9, static_w=0.1, dt_s=1e-3)  # 3 nJ a step: 3 uW beside 100 mW


def computer(idle_w: float | None = None) -> Computer:
    """Return a computer that takes 1 uJ for 1,000 operations."""
    known = {"source": "a paper", "evidence": "vendor"}
    idle = None if idle_w is None else {"value": idle_w, "unit": "W", **known}
    energy = {"value": 1000, "unit": "nJ", **known}
    return Computer.model_validate({"name": "one", "macs": 1000, "energy": energy, "idle": idle})


def test_energy_grows_with_operations_and_idle_power_with_time():
    assert computer().for_macs(2000) == pytest.approx(2e-6)
    assert computer().in_period(2000, 0.02) == pytest.approx(2e-6)
    assert computer(0.5).in_period(2000, 0.02) == pytest.approx(2e-6 + 0.01)


def test_a_computer_that_draws_less_than_the_chip_at_rest_loses_only_at_a_higher_rate():
    found = break_even(CHIP, computer(), 2000, rate_hz=50)  # 100 uW
    assert found.synaptic_operations is found.dynamic_j is None
    assert found.static_w == pytest.approx(100e-6 - 3e-6)
    assert found.rate_hz == pytest.approx((0.1 + 3e-6) / 2e-6)


def test_a_computer_that_idles_above_the_chip_is_never_as_cheap():
    found = break_even(CHIP, computer(0.5), 2000, rate_hz=50)
    assert found.rate_hz is None
    assert found.static_w == pytest.approx(0.5 + 100e-6 - 3e-6)
    assert found.dynamic_j == pytest.approx((0.5 + 100e-6 - 0.1) * 1e-3)
    assert found.synaptic_operations == pytest.approx((found.dynamic_j - 1e-9) / 2e-12)


def test_every_published_computer_has_a_source_and_a_network():
    names = [one.name for one in built_in()]
    assert len(set(names)) == len(names) >= 4
    for one in built_in():
        assert one.energy.source
        assert 1e-10 < one.energy.value / one.macs < 1e-6  # J for an operation


def test_operations_are_those_of_the_layers_that_were_measured():
    layers = {"Blouw": [390, 256, 256, 29], "MLPerf": [640, *[128] * 4, 8, *[128] * 4, 640]}
    counted = {k: sum(a * b for a, b in itertools.pairwise(v)) for k, v in layers.items()}
    for one in built_in():
        assert one.macs == counted[one.energy.source.split()[0]]
