"""Networks in a module, and functions and classes that make networks, found without a call."""

import textwrap

import nengo
import pytest

from spikeport.candidates import makers_in, networks_in
from spikeport.user_code import imported


@pytest.fixture
def module_of(tmp_path):
    def make(text):
        path = tmp_path / "some.py"
        path.write_text("import nengo\n" + textwrap.dedent(text), encoding="utf-8")
        return imported(str(path))

    return make


def test_networks_are_found_by_type_except_private_ones(module_of):
    module = module_of("a = nengo.Network()\n_b = nengo.Network()\nc = 3\n")
    assert networks_in(module) == {"a": module.a}


@pytest.mark.parametrize(
    "text",
    [
        "def make() -> nengo.Network: return other()",
        "def make() -> 'nengo.Network': return other()",
        "def make():\n    with nengo.Network() as net:\n        pass\n    return net",
        "def make():\n    net = nengo.Network()\n    return net",
        "def make():\n    return nengo.networks.EnsembleArray(5, 2)",
        "class make(nengo.Network): pass",
        "import functools\n@functools.cache\ndef make():\n    return nengo.Network()",
        "def base() -> nengo.Network: return 0\ndef make():\n    return base()",
        "def base(): return nengo.Network()\ndef make():\n    net = base()\n    return net",
        "def make():\n    net: nengo.Network = nengo.Network()\n    return net",
        "def make():\n    if (net := nengo.Network()):\n        return net",
        "def make():\n    return (net := nengo.Network())",
        "def make():\n    for _ in range(2):\n        net = nengo.Network()\n    return net",
        "class Base:\n    @staticmethod\n    def of(): return nengo.Network()\n"
        "def make(): return Base.of()",
    ],
)
def test_a_function_or_class_that_makes_a_network_is_found(module_of, text):
    assert "make" in makers_in(module_of(text))


@pytest.mark.parametrize(
    "text",
    [
        "def make(): return 3",
        "def make(net): return net.x",
        "def make():\n    nengo.Network()",
        "make = lambda: None",
        "make = 3",
        "from collections import deque as make",
        "from nengo.networks import EnsembleArray as make",
        "class make: pass",
        "def make(): return make()",
        "def make() -> 'unknown': return unknown()",
        "def make():\n    def other(): return nengo.Network()\n    return 3",
        "def make():\n    other = lambda: nengo.Network()\n    return other",
        "def make():\n    def other():\n        net = nengo.Network()\n    net = 3\n    return net",
        "def make():\n    class Other:\n        def of(self): return nengo.Network()\n    return 3",
        "def make():\n    net: nengo.Network\n    return net",
    ],
)
def test_objects_that_make_no_network_are_not_found(module_of, text):
    assert makers_in(module_of(text)) == {}


def test_functions_that_make_networks_are_found_without_a_call(module_of):
    module = module_of("""
        def make():
            raise AssertionError
            return nengo.Network()
    """)
    assert list(makers_in(module)) == ["make"]
    assert networks_in(nengo) == {}
