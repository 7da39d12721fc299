from dataclasses import replace

import nengo
import numpy as np
import pytest

from spikeport.compile.check.verify import verify, verify_learning, verify_settings, verify_size
from spikeport.compile.check.violation import DoesNotFitError, Violation
from spikeport.compile.pipeline import compile_network
from spikeport.errors import CompileError
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.limits import CoreUse
from tests.helpers.images import Group, Parts


def refusal(network: nengo.Network, passes: str = "") -> DoesNotFitError:
    """Return the refusal of a network, by default with one block on each core."""
    with pytest.raises(DoesNotFitError) as raised:
        compile_network(network, pipeline=passes)
    return raised.value


def host_node() -> nengo.Node:
    # A passthrough node, without a function, would be removed, as it leads nowhere.
    return nengo.Node(lambda _t, x: x, size_in=1)


@pytest.mark.slow
def test_a_readout_of_8_000_neurons_exceeds_the_in_axons_of_a_core() -> None:
    with nengo.Network(seed=1) as network:
        big = nengo.Ensemble(8000, 1, n_eval_points=100, label="big")
        out = host_node()
        nengo.Connection(big, out)
    error = refusal(network)
    # The two compartments of the read-out were split, which leaves each with all 8,000 axons.
    cure = (
        "split the source ensemble into 2 that decode into the same target, "
        "each with the targets divided by 2, or, if the source is on the host, let the target read "
        "fewer of its values"
    )
    assert error.violations == (
        Violation("SP102", "in-axons", "big -> read-out[1/2]", "8,000", "4,096", cure),
        Violation("SP102", "in-axons", "big -> read-out[2/2]", "8,000", "4,096", cure),
    )
    assert str(error) == (
        "the network does not fit chip 'loihi':\n"
        "  big -> read-out[1/2], big -> read-out[2/2]: SP102 in-axons: 8,000, limit 4,096; "
        f"cure: {cure}\n"
        "more: spikeport compile --explain SP102\n"
        "more: try -p compact, which rewrites the network and may take fewer cores"
    )
    assert isinstance(error, CompileError)


def test_splitting_the_source_cures_too_many_in_axons() -> None:
    with nengo.Network(seed=1) as network:
        out = host_node()
        for _ in range(2):
            half = nengo.Ensemble(4000, 1, n_eval_points=100)
            nengo.Connection(half, out, function=lambda x: x / 2)
    assert compile_network(network).image.n_compartments == 2 * 4000 + 2 * 2


@pytest.mark.slow
def test_more_blocks_than_cores_do_not_fit() -> None:
    with nengo.Network(seed=1) as network:
        for _ in range(130):
            nengo.Ensemble(1, 1)
    assert refusal(network).violations == (
        Violation(
            "SP201",
            "cores",
            "loihi",
            "130",
            "128",
            "use fewer or smaller ensembles or fewer decoded connections, or at least 2 times the "
            "chips, by [limits.chips] of a chip file (docs/adding.md)",
        ),
    )


def test_every_limit_is_reported_for_every_core_at_once() -> None:
    chip = chips.get("loihi")
    full = CoreUse("full", 1024, 4096, 4096, 2**20, 32, 8, 8)
    over = CoreUse("over", 1025, 8193, 4097, 3 * 2**20, 33, 9, 9)
    found = verify([over, full, over._replace(label="also")], chip)
    assert [(v.object, v.rule, v.used, v.limit) for v in found] == [
        ("over", "compartments", "1,025", "1,024"),
        ("also", "compartments", "1,025", "1,024"),
        ("over", "in-axons", "8,193", "4,096"),
        ("also", "in-axons", "8,193", "4,096"),
        ("over", "out-axons", "4,097", "4,096"),
        ("also", "out-axons", "4,097", "4,096"),
        ("over", "synapse-bits", "3,145,728", "1,048,576"),
        ("also", "synapse-bits", "3,145,728", "1,048,576"),
        ("over", "compartment-profiles", "33", "32"),
        ("also", "compartment-profiles", "33", "32"),
        ("over", "threshold-profiles", "9", "8"),
        ("also", "threshold-profiles", "9", "8"),
        ("over", "synapse-profiles", "9", "8"),
        ("also", "synapse-profiles", "9", "8"),
    ]


def test_a_cure_names_the_number_of_parts_that_helps() -> None:
    core = CoreUse("core", 1, 8193, 1, 1, 1, 1, 1)
    (violation,) = verify([core], chips.get("loihi"))
    assert violation.cure.startswith("split the source ensemble into 3 that decode")


@pytest.mark.slow
def test_several_violations_of_a_network_are_reported_at_once() -> None:
    with nengo.Network(seed=1) as network:
        big = nengo.Ensemble(8000, 1, n_eval_points=100)
        for _ in range(3):
            nengo.Connection(big, host_node())
        for _ in range(120):
            nengo.Ensemble(1, 1)
    found = {(v.rule, v.used) for v in refusal(network).violations}
    # 8 cores of 1,000 neurons, 3 read-outs in two halves, 120 ensembles of one neuron.
    assert found == {("cores", "134"), ("in-axons", "8,000"), ("out-axons", "6,000")}


def test_without_passes_each_block_gets_a_core_of_its_own_in_build_order() -> None:
    with nengo.Network(seed=1) as network:
        for label in "abc":
            nengo.Ensemble(2, 1, label=label)
    image = compile_network(network, pipeline="").image
    assert np.array_equal(image.blocks.core, [0, 1, 2])
    assert image.cores == ("a", "b", "c")


def test_blocks_of_different_voltage_bounds_on_one_core_are_reported() -> None:
    with nengo.Network(seed=1) as network:
        for label in "ab":
            nengo.Ensemble(2, 1, label=label)
    image = compile_network(network, pipeline="").image
    chip = chips.get("loihi")
    blocks = replace(image.blocks, core=np.array([0, 0]), vmin=np.array([0, -3]))
    packed = replace(image, blocks=blocks)
    assert [str(violation) for violation in verify_settings(packed, chip)] == [
        "a + b: SP108 shared settings: 2 of clipping, limit 1; cure: place blocks by their "
        "settings, with the pass pack of `-p as_written`"
    ]
    assert verify_settings(image, chip) == []


def test_more_compartments_than_the_whole_chip_has_are_refused_before_the_build(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert verify_size(128 * 1024, chips.get("loihi")) == []
    monkeypatch.setattr("spikeport.compile.pipeline.build", lambda *_: pytest.fail("was built"))
    with nengo.Network(seed=1) as network:
        nengo.Ensemble(128 * 1024 + 1, 1)
    (violation,) = refusal(network).violations
    assert violation[:5] == ("SP201", "cores", "loihi", "at least 129", "128")
    assert "or at least 2 times the chips" in violation.cure


def test_more_chips_are_no_cure_for_soft_cores_which_share_an_fpga() -> None:
    cure = "use fewer or smaller ensembles, or a larger FPGA: soft cores share one"
    chip = chips.get("softcore-up5k")
    (found,) = verify([CoreUse(f"core {n}", *[0] * 7) for n in range(2)], chip)
    assert [found.cure, *(one.cure for one in verify_size(513, chip))] == [cure] * 2


def test_a_chip_without_learning_refuses_synapses_that_learn() -> None:
    learning = Parts(groups=[Group([[64]], learning=(1,) * 7), Group([[64]])]).image()
    assert verify_learning(learning, chips.get("loihi")) == []
    assert [str(one) for one in verify_learning(learning, chips.get("softcore-ecp5-85f"))] == [
        "block 0: SP109 learning synapses: 1 groups, limit none; cure: keep what learns on the "
        "host with net.config[ensemble].on_chip = False, after spikeport.add_params(net)"
    ]
