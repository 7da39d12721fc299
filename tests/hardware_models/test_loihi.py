"""The figures of chips/loihi.toml, against the table they were taken from."""

import pytest
from pydantic import BaseModel

from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.figure import Figure

LOIHI = chips.get("loihi")
DAVIES = LOIHI.calibration("davies2018")
NAHUKU = LOIHI.calibration("nahuku-fit")


def figures(model: BaseModel) -> list[Figure]:
    """Return all figures inside a model, however deep."""
    found = [model] if isinstance(model, Figure) else []
    for name in type(model).model_fields:
        field = getattr(model, name)
        for value in field if isinstance(field, tuple) else [field]:
            found += figures(value) if isinstance(value, BaseModel) else []
    return found


def test_every_figure_has_source_and_evidence_and_is_in_si():
    found = figures(LOIHI)
    assert len(found) == 9 + 3 + 3 + 3 + 3 + (7 + 7 + 2) + (7 + 8 + 4)
    for figure in found:
        assert figure.source
        assert figure.evidence in {"code", "transcribed", "abstract", "vendor", "thread"}
        assert figure.unit in {"1", "bit", "J", "s", "W"}


def test_limits_and_topology_are_as_published():
    limits = {name: getattr(LOIHI.limits, name).count for name in type(LOIHI.limits).model_fields}
    assert limits == {
        "cores": 128,
        "chips": 1,
        "compartments": 1024,
        "in_axons": 4096,
        "out_axons": 4096,
        "synapse_bits": 1048576,
        "compartment_profiles": 32,
        "threshold_profiles": 8,
        "synapse_profiles": 8,
    }
    mesh = LOIHI.topology
    assert (mesh.tiles_x.count, mesh.tiles_y.count, mesh.cores_per_tile.count) == (8, 4, 4)
    assert "16" in LOIHI.limits.synapse_profiles.note


def test_figures_of_host_io_are_as_published():
    published = LOIHI.host_io
    step = published.step
    assert (step.low, step.value, step.high) == (0.95e-3, 8e-3, 9e-3)
    assert (step.evidence, published.word.count, published.packet.count) == ("thread", 32, 64)


def test_powers_are_as_published():
    power = LOIHI.power
    static = power.static_chip_w
    assert (static.low, static.value, static.high) == (0.029, 0.104, 0.110)
    assert power.host_processors_w.value == 0.065
    assert (power.board_idle_w.value, power.board_idle_w.evidence) == (0.94, "abstract")


@pytest.mark.parametrize(
    ("event", "energy_pj", "time_ns"),
    [
        ("synaptic_operation", 23.6, 3.5),
        ("update_active", 81, 8.4),
        ("update_inactive", 52, 5.3),
        ("spike", 1.7, 2.1),
        ("hop_east_west", 3.0, 4.1),
        ("hop_north_south", 4.0, 6.5),
        ("learning_update", 120, 6.1),
    ],
)
def test_davies_has_the_bounds_that_are_printed(event, energy_pj, time_ns):
    energy, time = getattr(DAVIES.energies, event), getattr(DAVIES.times, event)
    assert energy.value * 1e12 == pytest.approx(energy_pj)
    assert time.value * 1e9 == pytest.approx(time_ns)
    printed = event == "synaptic_operation"  # its energy as (min), its time as (max)
    assert (energy.low, energy.high) == (energy.value if printed else None, None)
    assert (time.low, time.high) == (None, time.value if printed else None)


@pytest.mark.parametrize(
    ("event", "value", "lowest", "highest"),
    [
        ("synaptic_operation", 35.5, 24.0, 35.5),
        ("update_active", 51.2 + 21.6, 51.2 + 21.6, 51.2 + 21.6),
        ("update_inactive", 51.2, 51.2, 51.2),
        ("spike", 69.3, 69.3, 69.3),
        ("message", 111, 111, 111),
        ("hop_east_west", 3.0, 3.0, 3.0),
        ("hop_north_south", 4.2, 4.2, 4.2),
    ],
)
def test_nahuku_energies_are_within_12_percent(event, value, lowest, highest):
    figure = getattr(NAHUKU.energies, event)
    found_pj = [1e12 * bound for bound in (figure.value, figure.low, figure.high)]
    assert found_pj == pytest.approx([value, 0.88 * lowest, 1.12 * highest])


@pytest.mark.parametrize(
    ("event", "value", "lowest", "highest"),
    [
        ("synaptic_operation", 3.8, 3.1, 4.7),
        ("update_active", 6.0 + 3.7, 6.0 + 3.7, 6.0 + 3.7),
        ("update_inactive", 6.0, 6.0, 6.0),
        ("spike", 30, 30, 30),
        ("message_in", 16, 16, 16),
        ("message_out", 5.1, 5.1, 5.1),
        ("hop_east_west", 4.1, 4.1, 4.1),
        ("hop_north_south", 6.5, 6.5, 6.5),
    ],
)
def test_nahuku_times_are_within_25_percent(event, value, lowest, highest):
    figure = getattr(NAHUKU.times, event)
    assert figure.value == pytest.approx(value * 1e-9)
    assert figure.low == pytest.approx(lowest * 0.75e-9)
    assert figure.high == pytest.approx(highest * 1.25e-9)


def test_barriers_are_as_published():
    davies = [(point.tiles, point.value) for point in DAVIES.barrier]
    assert davies == [(1, pytest.approx(113e-9)), (32, pytest.approx(465e-9))]
    for point, (tiles, us) in zip(
        NAHUKU.barrier, [(1, 0.6), (2, 1.0), (4, 1.4), (29, 1.8)], strict=True
    ):
        assert point.tiles == tiles
        assert [point.low, point.value, point.high] == pytest.approx(
            [0.75e-6 * us, 1e-6 * us, 1.25e-6 * us]
        )


def test_figures_that_are_not_public_are_absent():
    assert DAVIES.energies.message is None
    assert DAVIES.times.message_in is None
    assert NAHUKU.energies.learning_update is None
