"""Rules that exactness depends on, each alone, against figures computed by hand."""

from typing import Any

import numpy as np
import pytest

from spikeport.backends.native.chip import NativeChip
from spikeport.backends.native.kernel import decode
from spikeport.backends.nengo_loihi import NengoLoihiChip
from spikeport.compile.image.chip_image import ChipImage
from tests.helpers.images import INT32_MAX, Block, Group, Output, Parts, Route
from tests.helpers.oracle import Oracle, decay
from tests.helpers.side_by_side import (
    Snapshot,
    assert_equal_steps,
    random_spikes,
    silence,
    snapshot,
)

pytestmark = pytest.mark.filterwarnings("ignore:Overflow in")

Q_END, U_END, V_END = 2**21, 2**23, 2**31
"""The first numbers that registers cannot hold."""


def one_source(weights: list[int], **of_block: Any) -> ChipImage:
    """Return an image of one source on the host, which reaches a compartment with each weight."""
    return Parts(
        blocks=[Block(n=len(weights), **of_block)],
        groups=[Group(weights=[weights])],
        inputs=[1],
        routes=[Route(axon=[0], input=0)],
    ).image()


def spikes_at(*steps: int, n_steps: int) -> list[np.ndarray]:
    """Return the spikes of one source, which spikes at these steps, counted from 1."""
    return [np.zeros(int(t in steps), dtype=int) for t in range(1, n_steps + 1)]


def alone(image: ChipImage, n_steps: int) -> list[Snapshot]:
    return assert_equal_steps(image, 0, silence(n_steps))


def column(states: list[Snapshot], name: str, compartment: int = 0) -> list[int]:
    return [int(getattr(state, name)[compartment]) for state in states]


@pytest.mark.slow
def test_a_host_spike_arrives_in_the_next_step() -> None:
    states = assert_equal_steps(one_source([100]), 0, spikes_at(1, 3, n_steps=5))
    assert column(states, "q") == [0, 100, 0, 100, 0]


def test_a_chip_spike_arrives_in_the_next_step() -> None:
    image = Parts(
        blocks=[Block(bias=10, vth=25), Block(n=2)],
        groups=[Group(weights=[[5, -7]], block=1)],
        routes=[Route(axon=[0], block=0)],
    ).image()
    states = alone(image, 7)
    assert column(states, "spiked") == [0, 0, 1, 0, 0, 1, 0]
    assert column(states, "q", compartment=1) == [0, 0, 0, 5, 0, 0, 5]
    assert column(states, "q", compartment=2) == [0, 0, 0, -7, 0, 0, -7]


def test_current_is_updated_before_the_voltage_that_reads_it() -> None:
    states = assert_equal_steps(one_source([100]), 0, spikes_at(1, n_steps=3))
    assert column(states, "u") == [0, 100, 0]
    assert column(states, "v") == [0, 100, 100]


def test_a_threshold_must_be_exceeded() -> None:
    states = alone(Parts([Block(n=2, bias=[10, 11], vth=10)]).image(), 1)
    assert states[0].spiked.tolist() == [0, 1]
    assert states[0].v.tolist() == [10, 0]


def test_current_decays_by_one_more_than_its_constant_and_voltage_does_not() -> None:
    image = one_source([8192], decay_u=0, decay_v=0)
    states = assert_equal_steps(image, 0, spikes_at(1, n_steps=4))
    assert column(states, "u") == [0, 8192, 8190, 8188]
    assert column(states, "v") == [0, 8192, 8192 + 8190, 8192 + 8190 + 8188]


def test_decays_round_towards_zero_on_both_sides() -> None:
    image = one_source([1000, -1000], decay_u=2047, decay_v=2048, vmin=-(2**23) + 1)
    states = assert_equal_steps(image, 0, spikes_at(1, n_steps=13))
    positive, negative = column(states, "u", 0), column(states, "u", 1)
    assert positive == [0, 1000, 500, 250, 125, 62, 31, 15, 7, 3, 1, 0, 0]
    assert negative == [-u for u in positive]
    assert column(states, "v", 1) == [-v for v in column(states, "v", 0)]


@pytest.mark.parametrize("keep", [0, 1, 2047, 4094, 4095, 4096])
def test_any_voltage_decays_as_in_arithmetic_of_64_bits(keep: int) -> None:
    """The kernel multiplies in 32 bits; here from the smallest to the largest voltage."""
    voltages = np.concatenate([2 ** np.arange(31), 2 ** np.arange(31) - 1, [INT32_MAX]])
    voltages = np.concatenate([voltages, -voltages])
    n = len(voltages)
    image = Parts([Block(n=n, vmin=-INT32_MAX, vmax=INT32_MAX, decay_v=4096 - keep)]).image()
    chip = NativeChip(image, 0)
    chip.state.v[:] = voltages
    chip.step(np.array([]), {})
    np.testing.assert_array_equal(
        chip.state.v,
        np.where(decay(voltages, np.int64(keep)) > 2**23 - 1, 0, decay(voltages, np.int64(keep))),
    )


@pytest.mark.slow
def test_input_wraps_at_22_bits() -> None:
    weights = [Q_END - 1, Q_END, -Q_END, -Q_END - 1, 2 * Q_END, 3 * Q_END + 5]
    states = assert_equal_steps(one_source(weights), 0, spikes_at(1, n_steps=2))
    assert states[1].q.tolist() == [Q_END - 1, -Q_END, -Q_END, Q_END - 1, 0, -Q_END + 5]


@pytest.mark.slow
def test_input_wraps_at_22_bits_even_if_sums_have_16() -> None:
    """Sums have 16 bits if all weights are multiples of 64, as those of a compiled image are."""
    image = Parts(
        blocks=[Block(n=3)],
        groups=[Group(weights=[[64, Q_END - 64, -Q_END], [128, 3 * Q_END + 128, -64]])],
        inputs=[2],
        routes=[Route(axon=[0, 1], input=0)],
    ).image()
    states = assert_equal_steps(image, 0, [np.array([0, 1]), np.array([1]), np.array([], int)])
    assert NativeChip(image, 0).state.sums.dtype == np.int16
    assert states[1].q.tolist() == [192, 64, Q_END - 64]
    assert states[2].q.tolist() == [128, -Q_END + 128, -64]


def test_input_sums_beyond_32_bits_wrap_at_22() -> None:
    image = Parts(
        groups=[Group(weights=[[INT32_MAX], [INT32_MAX], [-INT32_MAX - 1]])],
        inputs=[3],
        routes=[Route(axon=[0, 1, 2], input=0)],
    ).image()
    both, lowest = np.array([0, 1]), np.array([2])
    states = assert_equal_steps(image, 0, [both, lowest, np.array([0]), np.array([], int)])
    assert column(states, "q") == [0, -2, 0, -1]


def test_weights_at_the_edges_of_16_bits_are_kept() -> None:
    weights = [2**15 - 1, 2**15, -(2**15), -(2**15) - 1]
    for w in weights:
        states = assert_equal_steps(one_source([w]), 0, spikes_at(1, n_steps=2))
        assert column(states, "q") == [0, w]


def test_the_most_negative_weight_of_32_bits_adds_nothing() -> None:
    """Its magnitude does not fit into 32 bits."""
    states = assert_equal_steps(one_source([-INT32_MAX - 1, 7]), 0, spikes_at(1, n_steps=2))
    assert states[1].q.tolist() == [0, 7]


def test_current_wraps_at_24_bits() -> None:
    """2^21 - 1 a step, hardly decaying: the fifth exceeds 2^23 - 1."""
    states = assert_equal_steps(
        one_source([Q_END - 1, 1 - Q_END], decay_u=0, decay_v=4095),
        0,
        spikes_at(*range(1, 9), n_steps=9),
    )
    u, size = [0], 0
    for _ in range(8):
        size = (abs(size) * 4095 >> 12) * (1 if size >= 0 else -1) + Q_END - 1
        size -= 2 * U_END * (size >= U_END)
        u.append(size)
    assert min(u) < 0 < max(u)
    assert column(states, "u") == u


def test_current_and_bias_wrap_at_24_bits_together() -> None:
    edge = [U_END - 1, U_END, -U_END, -U_END - 1, INT32_MAX]
    states = alone(Parts([Block(n=5, bias=edge, vth=INT32_MAX, vmin=-(2**24))]).image(), 1)
    assert states[0].v.tolist() == [U_END - 1, -U_END, -U_END, U_END - 1, -1]
    assert not states[0].u.any()


def test_voltage_wraps_at_32_bits_before_it_is_clipped() -> None:
    """-2^23 a step reaches -2^31 + 1 in 256 steps; one more wraps, and is clipped from above."""
    n = V_END // U_END
    block = Block(bias=-U_END, vmin=-V_END + 1, vmax=2**23 - 1, vth=2**22)
    states = alone(Parts([block]).image(), n + 3)
    v = column(states, "v")
    assert v[n - 2] == -U_END * (n - 1)
    assert v[n - 1] == -V_END + 1
    assert column(states, "spiked")[n - 1 :] == [0, 1, 0, 0]
    assert v[n:] == [0, -U_END, -2 * U_END]


def test_voltage_is_clipped_before_it_is_compared() -> None:
    at_limit = Block(n=2, bias=1000, vmax=511, vth=[510, 511])
    states = alone(Parts([at_limit]).image(), 2)
    assert [state.spiked.tolist() for state in states] == [[1, 0], [1, 0]]
    assert states[1].v.tolist() == [0, 511]
    low = alone(Parts([Block(bias=-1000, vmin=-511)]).image(), 2)
    assert column(low, "v") == [-511, -511]


@pytest.mark.parametrize(("delay", "rest"), [(0, 0), (1, 0), (2, 1), (3, 2), (63, 62)])
def test_a_refractory_delay_of_d_steps_silences_for_d_minus_one(delay: int, rest: int) -> None:
    """Delays 0 and 1 are the same: the count falls in the step of the spike already."""
    states = alone(Parts([Block(bias=10, vth=5, refract_delay=delay)]).image(), 2 * rest + 3)
    fired = [i for i, spiked in enumerate(column(states, "spiked")) if spiked]
    assert np.diff(fired).tolist() == [rest + 1] * (len(fired) - 1)
    assert len(fired) > 1
    assert column(states, "refractory")[0] == rest


def test_a_refractory_compartment_spikes_if_its_threshold_is_negative() -> None:
    """Refractory means voltage zero, not silence."""
    states = alone(Parts([Block(vth=-1, refract_delay=5)]).image(), 4)
    assert column(states, "spiked") == [1, 1, 1, 1]
    assert column(states, "refractory") == [4, 4, 4, 4]


def test_the_last_of_duplicate_indices_counts() -> None:
    image = Parts(
        blocks=[Block(n=3)],
        groups=[Group(weights=[[1, 20, 300, 4000]], indices=[[2, 0, 2, 0]])],
        inputs=[1],
        routes=[Route(axon=[0], input=0)],
    ).image()
    states = assert_equal_steps(image, 0, spikes_at(1, n_steps=2))
    assert states[1].q.tolist() == [4000, 0, 300]


def test_compartments_that_share_an_axon_add_up() -> None:
    image = Parts(
        blocks=[Block(n=3, bias=[10, 10, 0], vth=5), Block(n=2)],
        groups=[Group(weights=[[7, -9]], block=1)],
        inputs=[2],
        routes=[Route(axon=[0, 0, 0], block=0), Route(axon=[0, 0], input=0)],
    ).image()
    states = assert_equal_steps(image, 0, [np.array([0, 1])] * 2)
    assert states[1].q.tolist() == [0, 0, 0, 4 * 7, 4 * -9]


def test_an_atom_chooses_the_row_of_its_axon() -> None:
    image = Parts(
        blocks=[Block(n=2)],
        groups=[Group(weights=[[[1, 2], [30, 40], [500, 600]]], pop_type=32)],
        inputs=[3],
        routes=[Route(axon=[0, 0, 0], atom=[2, 0, 1], input=0)],
    ).image()
    states = assert_equal_steps(image, 0, [np.array([i]) for i in (0, 1, 2, 0)])
    assert [s.q.tolist() for s in states] == [[0, 0], [500, 600], [1, 2], [30, 40]]


def test_an_axon_base_shifts_targets_and_an_axon_or_base_of_minus_one_adds_nothing() -> None:
    image = Parts(
        blocks=[Block(n=4)],
        groups=[Group(weights=[[1, 2]], axon_row=[0, 0, 0], axon_base=[0, 2, -1])],
        inputs=[4],
        routes=[Route(axon=[0, 1, 2, -1], input=0)],
    ).image()
    states = assert_equal_steps(image, 0, [np.array([i]) for i in (0, 1, 2, 3, 3)])
    nothing = [0, 0, 0, 0]
    assert [s.q.tolist() for s in states] == [nothing, [1, 2, 0, 0], [0, 0, 1, 2], nothing, nothing]


def test_an_image_without_synapses_and_inputs_runs() -> None:
    image = Parts([Block(n=2, bias=[0, 3], vth=5)], outputs=[Output("spiked", [1])]).image()
    assert column(alone(image, 4), "spiked", 1) == [0, 1, 0, 1]


@pytest.mark.parametrize("at_membrane", [0, 1])
def test_noise_is_drawn_for_all_compartments_in_every_step(at_membrane: int) -> None:
    """The one stream is drawn in the order of compartments, even for those without noise."""
    block = Block(
        n=3,
        decay_v=4096,
        noise_exp=9,
        noise_offset=3,
        noise_at_membrane=at_membrane,
        enable_noise=[1, 0, 1],
    )
    image = Parts([Block(n=2), block]).image()
    states = assert_equal_steps(image, 5, silence(4))
    drawn = np.random.RandomState(5).randint(-127, 128, size=(4, 5), dtype=np.int32)
    expected = np.where([0, 0, 1, 0, 1], (drawn + 3 * 64) * 4, 0)
    reached = [s.v if at_membrane else s.q for s in states]
    np.testing.assert_array_equal(reached, expected)
    assert at_membrane != any(s.q.any() for s in states)


def test_noise_of_a_small_exponent_is_rounded_towards_zero() -> None:
    image = Parts([Block(n=200, decay_v=4096, noise_exp=2, enable_noise=1)]).image()
    (state,) = assert_equal_steps(image, 3, silence(1))
    drawn = np.random.RandomState(3).randint(-127, 128, size=200, dtype=np.int32)
    np.testing.assert_array_equal(state.q, np.trunc(drawn / 32))


def test_noise_is_added_before_input_wraps() -> None:
    image = one_source([Q_END - 1], noise_exp=7, noise_offset=2, enable_noise=1)
    states = assert_equal_steps(image, 0, spikes_at(1, n_steps=2))
    assert states[1].q[0] < 0


def test_noise_at_the_membrane_is_added_before_current_and_bias_wrap() -> None:
    block = Block(
        bias=U_END - 1, noise_offset=2, noise_at_membrane=1, enable_noise=1, vth=INT32_MAX
    )
    (state,) = alone(Parts([block]).image(), 1)
    assert -U_END <= state.v[0] < -U_END + 2**8


def test_a_source_that_spikes_twice_in_a_step_counts_twice() -> None:
    """The host never sends such spikes, but nengo-loihi's emulator counts them like this."""
    image = Parts(
        groups=[Group(weights=[[3]])], inputs=[2], routes=[Route(axon=[0, 0], input=0)]
    ).image()
    for chip in (NativeChip(image, 0), NengoLoihiChip(image, 0), Oracle(image, 0)):
        chip.step(np.array([1, 1]), {})
        chip.step(np.zeros(0, dtype=int), {})
        assert snapshot(chip).q.tolist() == [6]


def test_outputs_hold_the_state_of_their_compartments() -> None:
    block = Block(n=3, bias=[4, 40, 400], vth=100)
    reads = [Output(key, [2, 0, 2]) for key in ("voltage", "current", "spiked")]
    chip = NativeChip(Parts([block], outputs=reads).image(), 0)
    voltage, current, spiked = chip.step(np.array([]), {})
    assert (voltage.tolist(), current.tolist()) == ([0, 4, 0], [0, 0, 0])
    assert spiked.tolist() == [1, 0, 1]


@pytest.mark.slow
def test_blocks_of_a_thousand_compartments_step_as_on_the_emulator_and_the_oracle() -> None:
    """Vector instructions take over, and rows break into runs of all lengths."""
    rng = np.random.RandomState(4)
    n = 1024
    rows = [np.flatnonzero(rng.rand(n) < p) for p in (0.02, 0.5, 0.98)]
    image = Parts(
        blocks=[
            Block(n=n, bias=rng.randint(0, 3000, n), decay_v=rng.randint(0, 4096, n), vth=9000),
            Block(n=n - 7, core=1, decay_u=rng.randint(0, 4096, n - 7), vth=2**15, vmin=-1023),
        ],
        groups=[
            Group([rng.randint(-255, 256, len(r)) * 64 for r in rows], rows, block=0),
            Group([rng.randint(-255, 256, n - 7) * 64], block=1),
        ],
        inputs=[3],
        routes=[
            Route(axon=[0, 1, 2], input=0),
            Route(axon=rng.randint(-1, 3, n), block=0),
            Route(axon=rng.randint(-1, 1, n), block=0, group=1),
        ],
    ).image()
    states = assert_equal_steps(image, 0, random_spikes(image, 20, 1))
    assert states[-1].spike_count[:n].sum() > 1000 < states[-1].spike_count[n:].sum()


def test_a_chip_starts_at_rest() -> None:
    image = Parts([Block(n=2, bias=9)]).image()
    for chip in (NativeChip(image, 0), NengoLoihiChip(image, 0)):
        assert not any(array.any() for array in snapshot(chip))


@pytest.mark.parametrize(
    ("held", "values", "exact"),
    [([3, 0, 0], [3, 1.5], True), ([3, 4, 0], [3, 9.5], False), ([0, 0, 5], [-5, 0], True)],
)
def test_a_sum_of_several_terms_is_not_exact(
    held: list[int], values: list[float], exact: bool
) -> None:
    found = np.zeros(2)
    tables = np.array([0, 2, 4]), np.array([0, 2, 0, 1]), np.array([1.0, -1.0, 0.5, 2.0])
    assert decode(np.array(held, dtype=np.int32), *tables, found) == exact
    assert found.tolist() == values


def test_tables_without_values_decode_nothing() -> None:
    found = np.ones(2)
    none = np.zeros(0, dtype=int)
    assert not decode(np.zeros(3, dtype=np.int32), np.zeros(1, dtype=int), none, np.zeros(0), found)
    assert found.tolist() == [1, 1]
