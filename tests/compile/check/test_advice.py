"""Advice at the end of a refusal: on other passes, or on a move of ensembles to the host."""

import re
import warnings
from pathlib import Path
from typing import Any

import nengo
import numpy as np
import pytest
from nengo.solvers import NoSolver

from spikeport.compile.check.advice import AS_WRITTEN, COMPACT, MOST_CONNECTIONS, advice
from spikeport.compile.ground.refusal import ArgumentError, RefusedError
from spikeport.compile.ground.settings import add_params
from spikeport.compile.loihi.build_settings import BuildSettings
from spikeport.compile.pipeline import compile_network
from spikeport.hardware_models import chip as chips
from tests.helpers.chip_files import chip_file

LOIHI = chips.get("loihi")
OFFLOAD = "more: try --offload, which moves ensembles that are refused to the host"


def refusal(network: nengo.Network, passes: str = "as_written", **options: Any) -> RefusedError:
    with pytest.raises(RefusedError) as raised:
        compile_network(network, pipeline=passes, **options)
    return raised.value


def sparse() -> nengo.Network:
    """Return a network that nengo-loihi refuses, and the rewriter does not."""
    with nengo.Network(seed=1) as network:
        transform = nengo.Sparse((2, 2), indices=[[0, 0]], init=[1.0])
        nengo.Connection(nengo.Ensemble(20, 2), nengo.Ensemble(20, 2), transform=transform)
    return network


def test_advice_names_the_passes_that_compile_the_network_and_the_cores() -> None:
    error = refusal(sparse())
    assert error.advice == "more: it compiles with -p compact, on 1 core"
    assert str(error).endswith(
        "sample(rng).toarray()\nmore: it compiles with -p compact, on 1 core"
    )
    assert compile_network(sparse(), pipeline="compact").image.n_cores == 1


def test_advice_says_if_the_compact_passes_fail_too() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(20, 1, neuron_type=nengo.LIF(tau_rc=8.3))
        nengo.Connection(a, a)
    # Without its only ensemble, nothing would be left on the chip.
    assert refusal(network).advice == "more: it does not compile with -p compact either"
    assert refusal(network, "compact").advice == ""
    with network:
        nengo.Ensemble(20, 1)
    assert (
        refusal(network).advice == "more: it does not compile with -p compact either; try --offload"
    )
    assert refusal(network, "compact").advice == OFFLOAD
    assert compile_network(network, offload=True).image.n_cores == 1


def test_offloading_helps_a_rewritten_network_with_a_synapse_the_chip_lacks() -> None:
    with nengo.Network(seed=1) as network:
        node = nengo.Node([0.5])
        a, b = nengo.Ensemble(20, 1, label="a"), nengo.Ensemble(30, 1, label="b")
        nengo.Connection(node, a)
        nengo.Connection(a, b, synapse=nengo.Alpha(0.02))
    error = refusal(network, "compact")
    assert "SP005" in str(error)
    assert error.advice == OFFLOAD
    assert compile_network(network, pipeline="compact", offload=True).image.n_cores == 1


def test_problems_that_no_pass_can_mend_are_not_tried() -> None:
    with sparse() as network:
        nengo.Ensemble(5, 1, neuron_type=nengo.Tanh())
    error = refusal(network)
    for passes in (None, COMPACT, AS_WRITTEN):
        assert advice(network, error, LOIHI, pytest.fail, passes) == OFFLOAD
    assert error.advice == refusal(network, "compact").advice == OFFLOAD
    with nengo.Network(seed=1) as network:
        nengo.Ensemble(5, 1, gain=np.full(5, np.nan), bias=np.ones(5))
    assert refusal(network).advice == ""


@pytest.mark.parametrize("on_chip", [None, False])
@pytest.mark.parametrize(
    "ensemble", [{"encoders": [[0.0], [1.0]]}, {"gain": [1, 1]}, {"max_rates": [1000, 1000]}]
)
def test_a_refusal_does_not_advise_the_host_if_the_host_refuses_the_ensemble_too(
    ensemble: dict[str, list[int]], on_chip: bool | None
) -> None:
    with nengo.Network(seed=1) as network:
        add_params(network)
        nengo.Ensemble(2, 1)
        network.config[nengo.Ensemble(2, 1, **ensemble)].on_chip = on_chip
    for offload in (False, True):
        with pytest.raises(RefusedError) as raised:
            compile_network(network, offload=offload)
        assert not re.search("host|offload|compact", str(raised.value))


def test_a_refusal_of_nan_or_infinity_during_the_build_gets_no_advice() -> None:
    with nengo.Network(seed=1) as network:
        nengo.Connection(nengo.Ensemble(20, 1), nengo.Ensemble(20, 1), function=np.log)
    error = refusal(network)
    assert "SP011" in str(error)
    assert error.advice == ""


def test_learning_across_several_cores_is_not_tried_with_other_passes() -> None:
    with nengo.Network(seed=1) as network:
        pre, post = nengo.Ensemble(4100, 1, n_eval_points=500), nengo.Node(size_in=1)
        learned = nengo.Connection(
            pre, post, learning_rule_type=nengo.PES(), solver=NoSolver(np.zeros((4100, 1)))
        )
        nengo.Connection(post, learned.learning_rule)
        nengo.Ensemble(20, 1)
    error = refusal(network)
    assert "SP012" in str(error)
    for passes in (None, COMPACT, AS_WRITTEN):
        assert advice(network, error, LOIHI, pytest.fail, passes) == OFFLOAD
    assert error.advice == OFFLOAD


def test_a_network_too_large_for_the_chip_gets_no_advice_and_is_not_offloaded(
    tmp_path: Path,
) -> None:
    chip = chip_file(tmp_path / "small.toml", cores=1, compartments=30)
    with nengo.Network(seed=1) as network:
        for _ in range(4):
            nengo.Ensemble(20, 1)
    for passes in ("as_written", COMPACT):
        error = refusal(network, passes, chip=chip)
        assert "SP201 cores" in str(error)
        assert error.advice == ""  # no pass takes neurons away
        with pytest.raises(RefusedError, match="SP201 cores"):
            compile_network(network, chip, pipeline=passes, offload=True)


@pytest.mark.parametrize(("in_axons", "tried"), [(5, True), (4, False)])
def test_passes_that_would_cut_ensembles_into_many_pieces_are_not_tried(
    in_axons: int, tried: bool, tmp_path: Path
) -> None:
    network, calls = sparse(), []
    with network:
        nengo.Ensemble(160, 1)
    error = refusal(network)
    chip = chips.load(chip_file(tmp_path / "small.toml", in_axons=in_axons))
    found = advice(network, error, chip, lambda p: calls.append(p) or 1, COMPACT)
    assert (calls == [COMPACT]) == tried
    assert ("compiles with" in found) == tried


def test_passes_that_cut_nothing_are_tried_whatever_the_pieces(tmp_path: Path) -> None:
    network, chip = sparse(), chips.load(chip_file(tmp_path / "small.toml", in_axons=1))
    found = advice(network, refusal(network), chip, lambda _: 1, AS_WRITTEN)
    assert found == "more: it compiles with -p as_written, on 1 core"


def test_passes_that_refuse_the_build_settings_are_not_advised() -> None:
    settings = BuildSettings(decode_tau=0.01)
    assert refusal(sparse(), settings=settings).advice == OFFLOAD
    with pytest.raises(ArgumentError, match="decode_tau"):
        compile_network(sparse(), pipeline=COMPACT, settings=settings)


@pytest.mark.slow
def test_advice_names_as_written_if_only_these_passes_compile_the_network(tmp_path: Path) -> None:
    chip = chip_file(tmp_path / "few.toml", in_axons=200)
    with nengo.Network(seed=1) as network:
        add_params(network)
        b = nengo.Ensemble(60, 2)
        for _ in range(3):
            # `as_written` leaves the way of decoding to nengo-loihi.
            network.config[nengo.Connection(nengo.Ensemble(100, 2), b)].decode_path = "direct"
    error = refusal(network, COMPACT, chip=chip)
    assert "SP102 in-axons" in str(error)
    n_cores = compile_network(network, chip, pipeline=AS_WRITTEN).image.n_cores
    assert error.advice == f"more: it compiles with -p as_written, on {n_cores} cores"


def test_a_trial_compile_issues_no_warnings() -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert refusal(sparse()).advice == "more: it compiles with -p compact, on 1 core"
    assert caught == []


def test_a_large_network_that_the_builder_refuses_is_advised_to_offload(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("spikeport.compile.check.advice.MOST_NEURONS", 10)
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(20, 1, neuron_type=nengo.LIF(tau_rc=8.3))
        nengo.Connection(a, a)
        nengo.Ensemble(20, 1)
    assert refusal(network).advice == OFFLOAD
    assert compile_network(network, offload=True).image.n_cores == 1


@pytest.mark.slow
def test_a_large_network_is_refused_by_its_size_and_compact_is_only_advised() -> None:
    with nengo.Network(seed=1) as network:
        node, n = nengo.Node(size_in=400), 400
        for i in range(n):
            ensemble = nengo.Ensemble(2, 1)
            nengo.Connection(ensemble, node[i], synapse=None)
            nengo.Connection(node, ensemble, transform=np.ones((1, n)))
    assert len(network.all_connections) > MOST_CONNECTIONS
    # 400 * 400 connections of 20 decode neurons, and 400 * 2 neurons, on cores of 1,024.
    assert str(refusal(network)) == (
        "the network does not fit chip 'loihi':\n"
        "  loihi: SP201 cores: at least 3,126, limit 128; cure: use fewer or smaller ensembles or "
        "fewer decoded connections, or at least 25 times the chips, by [limits.chips] of a chip "
        "file (docs/adding.md)\n"
        "more: spikeport compile --explain SP201\n"
        "more: try -p compact, which rewrites the network and may take fewer cores"
    )
