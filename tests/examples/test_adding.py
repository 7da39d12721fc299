"""The modules of docs/adding.md, which do what the page says."""

import re
import sys
from pathlib import Path
from types import ModuleType

import nengo
import numpy as np
import pytest

from spikeport import compile_network
from spikeport.backends.host_loop import HostLoop
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.check.rules import RULES
from spikeport.compile.passes.pipeline import Pipeline
from spikeport.experiments import driver
from spikeport.experiments.options import Options

PAGE = (Path(__file__).parents[2] / "docs" / "adding.md").read_text(encoding="utf-8")


@pytest.fixture
def module(monkeypatch):
    """Return a function that makes one of the page's modules, by the path in its first line."""

    def made(path: str) -> ModuleType:
        (code,) = re.findall(rf"^```python\n(# {path}\n.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
        module = ModuleType("spikeport." + path.removesuffix(".py").replace("/", "."))
        monkeypatch.setitem(sys.modules, module.__name__, module)
        exec(code, module.__dict__)
        return module

    return made


@pytest.fixture
def network():
    with nengo.Network(seed=0) as network:
        ensembles = [nengo.Ensemble(600, 1) for _ in range(3)]
        for pre, post in zip([nengo.Node(np.cos), *ensembles], ensembles, strict=False):
            nengo.Connection(pre, post)
        network.probe = nengo.Probe(ensembles[-1], synapse=0.01)
    return network


@pytest.mark.slow
def test_the_pass_renumbers_cores(module, network):
    reverse = module("compile/passes/reverse_cores.py").ReverseCores()
    usual = compile_network(network, pipeline=Pipeline(())).image.blocks.core
    made = compile_network(network, pipeline=Pipeline((reverse,))).image.blocks.core
    assert usual.max() > 0
    np.testing.assert_array_equal(made, usual.max() - usual)


@pytest.mark.slow
def test_the_backend_counts_spikes_and_equals_the_native_one_bit_for_bit(module, network):
    compiled = compile_network(network)
    chips = [NativeChip(compiled.image, 0) for _ in range(2)]
    counting = module("backends/counting.py").HostSpikeCounter(chips[0])
    loops = [HostLoop(compiled, chip, 0) for chip in (counting, chips[1])]
    for _ in range(50):
        for loop in loops:
            loop.step()
    np.testing.assert_array_equal(*(loop.data(network.probe) for loop in loops))
    assert 0 < counting.host_spikes == counting.activity().host_spikes.sum()


@pytest.mark.slow
def test_the_experiment_reaches_near_targets(module, tmp_path):
    near = module("experiments/arm/near.py")
    trial = near.EXPERIMENT.trial(near.NearSettings(), Options(1.0, backend="analytic"))
    assert driver.run(trial, tmp_path / "run").result["metrics"]["reaches"] > 0


def test_the_rule_has_the_next_free_number():
    used = {rule.id for rule in RULES.values() if rule.id.startswith("SP0")}
    assert f'id = "SP{max(int(one[2:]) for one in used) + 1:03}"' in PAGE
