"""Energies and times of one source."""

import pytest
from pydantic import ValidationError

from spikeport.hardware_models.calibration import EnergyCalibration

ORIGIN = {"source": "a paper", "evidence": "vendor"}
SPIKE = {"value": 2, "unit": "ns", **ORIGIN}


def point(tiles, ns=5):
    return {"tiles": tiles, "value": ns, "unit": "ns", **ORIGIN}


def test_figures_are_converted_to_si():
    made = EnergyCalibration(name="a", description="", times={"spike": SPIKE}, barrier=[point(3)])
    assert (made.times.spike.value, made.times.spike.unit) == (pytest.approx(2e-9), "s")
    assert (made.barrier[0].value, made.barrier[0].tiles) == (pytest.approx(5e-9), 3)
    assert made.energies.spike is None


def test_a_calibration_with_any_time_or_barrier_has_times():
    assert not EnergyCalibration(name="a", description="").has_times
    assert EnergyCalibration(name="a", description="", times={"spike": SPIKE}).has_times
    assert EnergyCalibration(name="a", description="", barrier=[point(1)]).has_times


@pytest.mark.parametrize("tiles", [(2, 1), (1, 1)])
def test_a_barrier_whose_tiles_do_not_increase_is_refused(tiles):
    with pytest.raises(ValidationError, match=r"tiles must increase from point to point"):
        EnergyCalibration(name="a", description="", barrier=[point(n) for n in tiles])


def test_an_energy_in_a_unit_of_time_is_refused():
    with pytest.raises(ValidationError, match="unit 'ns' does not convert to 'J'"):
        EnergyCalibration(name="a", description="", energies={"spike": SPIKE})
