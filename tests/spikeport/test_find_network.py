import nengo
import pytest

from spikeport.errors import NetworkError, UsageError
from spikeport.find_network import find_network, needed_passes


def refusal(spec, *pairs):
    with pytest.raises(UsageError) as caught:
        find_network(str(spec), list(pairs))
    return str(caught.value)


@pytest.mark.slow
def test_the_arm_is_built_in():
    network = find_network("arm", ["m1=60"])
    assert {e.label for e in network.all_ensembles} >= {"S1", "M1 x", "CB gravity"}


def test_built_in_networks_know_the_passes_they_need():
    passes = {spec: needed_passes(spec) for spec in ("arm", "humanoid", "walk", "net.py:make")}
    assert passes == {"arm": None, "humanoid": "compact", "walk": "compact", "net.py:make": None}


def test_a_built_in_network_takes_the_settings_of_its_experiment():
    assert refusal("walk", "gait=1").startswith("unknown key of network 'walk' 'gait'; there is: ")


def test_a_function_in_a_file_is_called_with_its_settings(net_py):
    network = find_network(f"{net_py}:make", ["n_neurons=7", "label=seven"])
    (ensemble,) = network.all_ensembles
    assert (ensemble.n_neurons, ensemble.label) == (7, "seven")


def test_a_path_with_a_colon_is_split_at_the_last(net_py):
    odd = net_py.with_name("a:b.py")
    net_py.rename(odd)
    assert isinstance(find_network(f"{odd}:make", []), nengo.Network)


def test_a_function_in_a_module_is_found(net_py, monkeypatch):
    monkeypatch.syspath_prepend(net_py.parent)
    net_py.rename(net_py.with_name("user_module_of_networks.py"))
    network = find_network("user_module_of_networks:make", [])
    assert network.all_ensembles[0].n_neurons == 20


@pytest.mark.parametrize("spec", ["leg", "leg:", ":make", "", "net.py"])
def test_an_unknown_name_lists_what_can_be_given(spec):
    assert refusal(spec) == (
        f"unknown network '{spec}'; there is: arm, graph.nir, humanoid, module:function, "
        "path/to/file.py:function, walk"
    )


def test_a_missing_file_is_named(tmp_path):
    assert refusal(f"{tmp_path}/no.py:make") == f"{tmp_path}/no.py: no such file"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("import no_such_package", "ModuleNotFoundError: No module named 'no_such_package'"),
        ("raise SystemExit(0)", "SystemExit: 0"),
    ],
)
def test_a_file_that_raises_on_import_says_what(tmp_path, text, reason):
    path = tmp_path / "broken.py"
    path.write_text(text, encoding="utf-8")
    assert refusal(f"{path}:make") == f"{path}: cannot be imported: {reason}"


def test_a_file_that_is_not_python_says_where(tmp_path):
    path = tmp_path / "broken.py"
    path.write_text("def make(:\n", encoding="utf-8")
    assert refusal(f"{path}:make").startswith(f"{path}: cannot be imported: SyntaxError: ")


def test_a_missing_module_is_named():
    assert refusal("no_such_module:make") == (
        "module 'no_such_module' cannot be imported: "
        "ModuleNotFoundError: No module named 'no_such_module'"
    )


def test_a_relative_module_is_refused():
    assert refusal(".net:make").startswith("module '.net' cannot be imported: TypeError: ")


def test_a_missing_function_lists_the_functions(tmp_path):
    path = tmp_path / "two.py"
    path.write_text("b = a = lambda: None\n_c = a\nnumber = 1\n", encoding="utf-8")
    assert refusal(f"{path}:make") == f"unknown function of {path} 'make'; there is: a, b"
    assert refusal(f"{path}:number") == f"unknown function of {path} 'number'; there is: a, b"


def test_what_is_not_a_network_is_named(net_py):
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
    assert str(caught.value) == f"{spec}: raised {reason}"


def test_an_unknown_key_lists_the_functions_parameters(net_py):
    spec = f"{net_py}:make"
    assert refusal(spec, "size=1") == (
        f"unknown key of network '{spec}' 'size'; there is: label, n_neurons, tau"
    )


def test_our_own_errors_pass_as_they_are():
    assert (
        refusal("arm", "box=huge")
        == "unknown box 'huge'; there is: large, small, x0:x1,y0:y1,z0:z1 (m)"
    )
