import sys
from dataclasses import fields

import nengo
import pytest

from spikeport.errors import NetworkError, UsageError
from spikeport.experiments.walk.settings import WalkSettings
from spikeport.find_network import find_network, needed_passes, parts


def refusal(spec, *pairs):
    with pytest.raises(UsageError) as caught:
        find_network(str(spec), list(pairs))
    return str(caught.value)


@pytest.mark.slow
@pytest.mark.usefixtures("with_kept")
def test_the_built_in_arm_takes_the_settings_of_its_experiment():
    network = find_network("arm", ["m1=60", "s1=10", "network_seed=3"])
    sizes = {e.label: e.n_neurons for e in network.all_ensembles}
    assert sizes["S1"] == 11 * 10  # of as many dimensions
    assert {sizes[f"M1 {axis}"] for axis in "xyz"} == {60}
    assert "CB gravity" in sizes
    assert network.seed == 3


def test_built_in_networks_know_the_passes_they_need():
    passes = {spec: needed_passes(spec) for spec in ("arm", "humanoid", "walk", "net.py:make")}
    assert passes == {"arm": None, "humanoid": "compact", "walk": "compact", "net.py:make": None}


def test_a_built_in_network_refuses_an_unknown_key_with_those_of_its_experiment():
    keys = ", ".join(sorted(field.name for field in fields(WalkSettings)))
    assert refusal("walk", "stride=1") == (
        f"unknown key of network 'walk' 'stride'; choose from: {keys}"
    )


def test_a_function_in_a_file_is_called_with_its_settings(net_py):
    network = find_network(f"{net_py}:make", ["n_neurons=7", "label=seven"])
    (ensemble,) = network.all_ensembles
    assert (ensemble.n_neurons, ensemble.label) == (7, "seven")


@pytest.mark.parametrize(
    ("spec", "where", "name"),
    [
        ("net.py", "net.py", ""),
        ("a:b/net.ipynb:make", "a:b/net.ipynb", "make"),
        ("a:b/graph.nir", "a:b/graph.nir", ""),
        ("arm", "", "arm"),
    ],
)
def test_a_spec_has_the_parts_where_and_name(spec, where, name):
    assert parts(spec) == (where, name)


def test_a_path_with_colons_is_split_at_the_last_one(net_py):
    odd = net_py.with_name("a:b.py")
    net_py.rename(odd)
    assert isinstance(find_network(f"{odd}:make", []), nengo.Network)


def test_a_function_in_a_module_is_found(net_py, monkeypatch):
    monkeypatch.syspath_prepend(net_py.parent)
    net_py.rename(net_py.with_name("user_module_of_networks.py"))
    network = find_network("user_module_of_networks:make", [])
    assert network.all_ensembles[0].n_neurons == 20


@pytest.mark.parametrize("spec", ["leg", "leg:", ":make", ""])
def test_an_unknown_name_lists_the_names_and_forms_of_networks(spec):
    assert refusal(spec) == (
        f"unknown network '{spec}'; choose from: FILE.ipynb, FILE.py, FILE.py:NAME, arm, "
        "graph.nir, humanoid, module:NAME, walk"
    )


def test_a_missing_file_is_named(tmp_path):
    assert refusal(f"{tmp_path}/no.py:make") == f"{tmp_path}/no.py: no such file"


SEVERAL = """
from collections import deque

import nengo
from nengo.networks import EnsembleArray


def small():
    with nengo.Network(seed=1) as net:
        nengo.Ensemble(5, 1)
    return net


def numbers() -> list:
    return [1]


ring = nengo.Network(seed=2)
"""


def test_a_missing_name_lists_only_networks_and_functions_that_make_them(tmp_path):
    path = tmp_path / "several.py"
    path.write_text(SEVERAL, encoding="utf-8")
    assert refusal(f"{path}:make") == f"unknown network of {path} 'make'; choose from: ring, small"


def test_the_refusal_of_a_file_without_networks_says_so(tmp_path):
    path = tmp_path / "no_network.py"
    path.write_text("number = 1\n", encoding="utf-8")
    assert refusal(f"{path}:number") == f"unknown network of {path} 'number'; there is none in it"
    assert refusal(path) == (
        f"{path}: no network in it: name one `model`, or write a function that returns one"
    )


@pytest.mark.parametrize(
    ("text", "label"),
    [
        ("ring = nengo.Network(label='r')\nmodel = nengo.Network(label='m')", "m"),
        ("net = nengo.Network(label='n')\ndef other():\n    return nengo.Network()", "n"),
        ("ring = same = nengo.Network(label='r')", "r"),
        ("model = net = nengo.Network(label='m')", "m"),
        ("with nengo.Network(label='o') as o:\n    net = nengo.networks.EnsembleArray(5, 2)", "o"),
        ("def f() -> nengo.Network:\n    return g()\ng = lambda: nengo.Network(label='f')", "f"),
        ("class Own(nengo.Network):\n    def __init__(self):\n        super().__init__('o')", "o"),
    ],
)
def test_a_file_without_a_name_is_searched_for_its_network(tmp_path, text, label):
    path = tmp_path / "alone.py"
    path.write_text(f"import nengo\n{text}\n", encoding="utf-8")
    assert find_network(str(path), []).label == label


RUNS_ITSELF = """
import nengo
import nengo_loihi

with nengo.Network(seed=1) as model:
    ensemble = nengo.Ensemble(10, 1)
    probe = nengo.Probe(ensemble)

with nengo_loihi.Simulator(model, progress_bar=False) as sim:
    sim.run(0.005)
"""


def test_a_script_may_run_its_own_network_on_nengo_loihi(tmp_path):
    path = tmp_path / "script.py"
    path.write_text(RUNS_ITSELF, encoding="utf-8")
    assert find_network(str(path), []).all_ensembles[0].n_neurons == 10


@pytest.mark.parametrize("name", ["", ":make"])
def test_a_script_does_not_see_spikeports_arguments(tmp_path, name):
    path = tmp_path / "script.py"
    path.write_text(
        "import argparse, nengo\n"
        "def make():\n"
        "    parser = argparse.ArgumentParser()\n"
        "    parser.add_argument('--n', type=int, default=50)\n"
        "    with nengo.Network(label=parser.prog) as net:\n"
        "        nengo.Ensemble(parser.parse_args().n, 1)\n"
        "    return net\n" + ("" if name else "model = make()\n")
    )
    ours = list(sys.argv)
    network = find_network(f"{path}{name}", [])
    assert (network.label, network.ensembles[0].n_neurons) == ("script.py", 50)
    assert sys.argv == ours


def test_a_file_with_several_networks_is_refused_with_their_names(tmp_path):
    path = tmp_path / "several.py"
    path.write_text(SEVERAL + "line = nengo.Network()\n", encoding="utf-8")
    assert refusal(path) == (
        f"{path}: several networks in it, none called model or net; give {path}:line, "
        f"{path}:ring, {path}:small"
    )


def test_a_file_with_two_networks_of_usual_names_is_refused(tmp_path):
    path = tmp_path / "two.py"
    path.write_text("import nengo\nmodel, net, ring = (nengo.Network() for _ in range(3))\n")
    assert refusal(path) == (
        f"{path}: several networks in it, called model and net; give {path}:model, {path}:net"
    )


def test_a_network_object_takes_no_settings(tmp_path):
    path = tmp_path / "model.py"
    path.write_text("import nengo\nmodel = nengo.Network()\n", encoding="utf-8")
    assert refusal(f"{path}:model", "size=1") == (
        f"--set size=1: {path}:model is a network, not a function: it takes none"
    )


def test_a_function_that_does_not_return_a_network_is_refused(net_py):
    spec = f"{net_py}:returns_text"
    assert refusal(spec) == f"{spec}: returned str, expected nengo.Network"


def test_a_missing_argument_is_named(net_py):
    spec = f"{net_py}:needs"
    assert refusal(spec) == (
        f"{spec}: missing a required argument: 'size'; give its arguments with --set KEY=VALUE"
    )


@pytest.mark.parametrize(
    ("function", "reason"),
    [
        ("raises_value_error", "ValueError: the sizes do not match"),
        ("raises_type_error", "TypeError: object of type 'int' has no len()"),
        ("divides_by_zero", "ZeroDivisionError: division by zero"),
    ],
)
def test_a_function_that_raises_is_named_with_its_error(net_py, function, reason):
    spec = f"{net_py}:{function}"
    with pytest.raises(NetworkError) as caught:
        find_network(spec, [])
    assert str(caught.value).startswith(f"{spec}: raised {reason} (")


@pytest.mark.parametrize("text", ["raise RuntimeError", "return 5", "raise SystemExit(0)"])
def test_an_error_whose_text_fails_is_named_by_its_class(tmp_path, text):
    path = tmp_path / "odd.py"
    odd = f"class Odd(BaseException):\n    def __str__(self): {text}\n"
    path.write_text(f"{odd}def make(): raise Odd\n", encoding="utf-8")
    with pytest.raises(NetworkError) as caught:
        find_network(f"{path}:make", [])
    assert str(caught.value) == f"{path}:make: raised Odd, which has no text ({path}, line 3)"


def test_an_unknown_key_lists_the_functions_parameters(net_py):
    spec = f"{net_py}:make"
    assert refusal(spec, "size=1") == (
        f"unknown key of network '{spec}' 'size'; choose from: label, n_neurons, tau"
    )


def test_spikeports_own_errors_are_passed_on_unchanged():
    assert (
        refusal("arm", "box=huge")
        == "unknown box 'huge'; choose from: large, small, x0:x1,y0:y1,z0:z1 (m)"
    )


def test_a_name_behind_a_nir_graph_is_refused_and_a_module_may_be_called_nir(tmp_path, monkeypatch):
    (path := tmp_path / "graph.nir").write_bytes(b"")
    with pytest.raises(UsageError) as caught:
        find_network(f"{path}:one", [])
    assert str(caught.value) == (
        f"{path}:one: a NIR graph is one network, without names; cure: give {path}"
    )
    (tmp_path / "package_with").mkdir()
    code = "import nengo\nmodel = nengo.Network()\n"
    (tmp_path / "package_with" / "nir.py").write_text(code)
    monkeypatch.syspath_prepend(tmp_path)
    assert find_network("package_with.nir:model", []).all_objects == []
