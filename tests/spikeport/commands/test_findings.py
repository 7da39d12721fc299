"""Findings on a compile, from stated rates and from a run; test_against_written tests the hints."""

from dataclasses import replace

import nengo
import pytest

from spikeport.commands.findings import Compiled, findings_on
from spikeport.compile.image.expected import Rates
from spikeport.compile.pipeline import compile_network
from spikeport.progress import silent


@pytest.fixture(scope="module")
def compiled() -> Compiled:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(20, 1, label="a")
        nengo.Connection(nengo.Node(0.5), a)
        nengo.Probe(a, synapse=0.01)
    compilation = compile_network(network, pipeline="as_written")
    return Compiled(network, compilation, "loihi", "as_written", None, None)


def test_a_compile_alone_has_no_costs(compiled: Compiled) -> None:
    found = findings_on(compiled, silent)
    assert (found.activity, found.modules, found.loss) == (None, None, None)
    assert found.report == compiled.compilation.report


def test_costs_are_those_at_stated_rates_or_of_a_run(compiled: Compiled) -> None:
    stated = findings_on(replace(compiled, rates=Rates(100.0, {})), silent)
    assert stated.activity is not None
    assert (stated.rates, stated.loss) == (Rates(100.0, {}), None)
    stages: list[str] = []
    ran = findings_on(replace(compiled, loss_s=0.02), lambda what, _share: stages.append(what))
    assert ran.activity is not None
    assert ran.activity.n_steps == 20
    assert ran.loss is not None
    assert stages[-1:] != ["compiling as written"]  # its passes are as written
