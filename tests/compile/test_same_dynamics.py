"""Dynamics of networks after network passes: the same in float, with the same filters if built."""

import warnings

import nengo
import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

import spikeport
from spikeport.compile.loihi.build import build
from spikeport.compile.passes.base import NetworkPass
from spikeport.compile.passes.decode_path import DecodePath, PathChoice
from spikeport.compile.passes.fuse import Fuse
from spikeport.compile.passes.split_ensembles import SplitEnsembles
from spikeport.compile.rewriting.slices import whole_targets
from tests.helpers.drawn_networks import PLANS, Link, Plan, built
from tests.helpers.random_networks import DT_S, assert_equal_in_float, rewritten

CUT = SplitEnsembles(max_neurons=9)
PASSES: list[tuple[NetworkPass, ...]] = [
    (CUT,),
    (Fuse(),),
    (DecodePath(),),
    (DecodePath(default="onoff"),),
    (Fuse(), DecodePath(default="direct")),
    (CUT, Fuse(), DecodePath(default="host")),
    (CUT, Fuse(), DecodePath()),
]
DRAWN = settings(max_examples=12, phases=[Phase.generate])
# Spikes that go straight to neurons ask for filters that decoded values lack.
OF_VALUES = PLANS.filter(lambda plan: not plan.sends_spikes)
SLOW = Link("values", pre=0, post=1, tau=0.1, seed=0)


@pytest.mark.slow
@DRAWN
@given(plan=PLANS, passes=st.sampled_from(PASSES))
def test_every_probe_records_the_same_in_float_after_passes(
    plan: Plan, passes: tuple[NetworkPass, ...]
) -> None:
    assert_equal_in_float(built(plan), *passes)


@pytest.mark.slow
@DRAWN
@given(plan=OF_VALUES, default=st.sampled_from(["auto", "onoff"]))
def test_every_connection_keeps_its_own_filter(plan: Plan, default: PathChoice) -> None:
    """From 11 ms on, the delays of a relay and its target add up to the connection's own filter."""
    plan = plan._replace(links=(*plan.links, SLOW))
    rewrite, _ = rewritten(built(plan), CUT, Fuse(), DecodePath(default=default))
    passages = build(whole_targets(rewrite, DT_S), DT_S).passages
    for target in {one.target for one in passages}:
        asked = [one.target_s for one in passages if one.target == target]
        assert max(asked) - min(asked) < 0.006 + 1e-9
    for one in passages:
        if one.relay_s is None:
            assert not one.source or one.target_s == one.own_s
        elif one.own_s >= 0.011:
            assert one.relay_s + DT_S + one.target_s == pytest.approx(one.own_s)
        else:
            assert one.relay_s <= one.own_s
    relayed = {one.own_s for one in passages if one.relay_s is not None}
    assert SLOW.tau in relayed or default == "auto"


def run(network: nengo.Network, pipeline: str | None) -> np.ndarray:
    """Return what the only probe records in 1 s: on the chip, or in float without a pipeline."""
    (probe,) = network.probes
    kind = nengo.Simulator if pipeline is None else spikeport.Simulator
    options = {"pipeline": pipeline} if pipeline else {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with kind(network, progress_bar=False, **options) as simulator:
            simulator.run_steps(1000)
            found: np.ndarray = simulator.data[probe][:, 0]
            return found


def fed_back(*gains: tuple[float, float]) -> nengo.Network:
    """Return an ensemble with an input through 5 ms, fed back with gains and time constants."""
    with nengo.Network(seed=0) as network:
        a = nengo.Ensemble(200, 1)
        nengo.Connection(nengo.Node([0.5]), a, synapse=0.005)
        for gain, tau in gains:
            nengo.Connection(a, a, transform=gain, synapse=tau)
        nengo.Probe(a, synapse=0.01)
    return network


def rise_ms(values: np.ndarray) -> int:
    """Return the steps until nine tenths of the steady value are reached."""
    return int(np.argmax(values > 0.9 * values[-300:].mean()))


LOOPS = [((0.2, 0.1),), ((0.2, 0.1), (-0.4, 0.005)), ((0.5, 0.1), (0.2, 0.005))]


@pytest.mark.slow
@pytest.mark.parametrize("gains", LOOPS)
def test_feedback_loops_rise_and_settle_on_the_chip_as_in_float(
    gains: tuple[tuple[float, float], ...],
) -> None:
    network = fed_back(*gains)
    wanted, found = (run(network, pipeline) for pipeline in (None, "compact"))
    assert found[-300:].mean() == pytest.approx(wanted[-300:].mean(), rel=0.04)
    assert rise_ms(found) == pytest.approx(rise_ms(wanted), rel=0.2)


def test_a_weak_slow_loop_compiles_by_default() -> None:
    """nengo-loihi's own discretiser finds no exponent for the weights of this loop."""
    network = fed_back((0.2, 0.1))
    wanted, found = (run(network, pipeline) for pipeline in (None, "as_written"))
    assert found[-300:].mean() == pytest.approx(wanted[-300:].mean(), rel=0.04)
