"""``spikeport passes``, and the passes of ``spikeport compile``."""

from types import SimpleNamespace

import pytest

from spikeport.commands.passes import pass_lines
from spikeport.compile.passes import registry
from spikeport.hardware_models import chip as chips
from tests.helpers.chip_files import chip_file

PAIRS = """
import nengo
import spikeport


def make():
    with nengo.Network(seed=1) as network:
        spikeport.add_params(network)
        a, b = nengo.Ensemble(20, 1), nengo.Ensemble(20, 1)
        for path in ("host", "host", "auto"):
            connection = nengo.Connection(a, b)
            network.config[connection].decode_path = path
    return network
"""


def test_passes_lists_every_pass_with_its_options_and_the_default_pipelines(spikeport):
    done = spikeport("passes")
    assert done.code == 0
    assert [name for name in registry.PASSES if name not in done.out] == []
    assert "effort: int = 4, exact: bool = False" in done.out
    for name, text in registry.PIPELINES.items():
        assert f"{name}: {text}\n" in done.out
    for name in chips.names():
        assert f"default of {name}: {chips.get(name).pipeline}\n" in done.out


def test_a_pipeline_can_be_chosen_by_name(spikeport, net_py):
    done = spikeport("compile", f"{net_py}:make", "-p", "compact", "--print-after", "all")
    assert done.code == 0
    after = [line for line in done.out.splitlines() if line.startswith("after ")]
    assert after == [f"after {name}:" for name in registry.PIPELINES["compact"].split(",")]


def test_passes_can_be_chosen_one_by_one_with_options(spikeport, net_py):
    done = spikeport("compile", f"{net_py}:make", "--passes", "")
    assert (done.code, "on 2 cores" in done.out) == (0, True)
    done = spikeport("compile", f"{net_py}:make", "-p", "pack{effort=0}")
    assert (done.code, "on 1 core" in done.out) == (0, True)
    assert "pack: cores 2 -> 1\n" in done.out


def test_connections_are_counted_by_their_decode_path(spikeport, tmp_path):
    (tmp_path / "pairs.py").write_text(PAIRS, encoding="utf-8")
    done = spikeport("compile", f"{tmp_path / 'pairs.py'}:make", "-p", "decode_path")
    assert done.code == 0
    assert "decode_path: 1 direct, 2 host\n" in done.out


def test_changes_of_a_pass_are_printed_with_three_digits():
    notes = {
        "cores": {"before": None, "after": 1200},
        "energy_step_j (fit)": {"before": 1.23456e-6, "after": 0.00012},
        "same": {"before": 2, "after": 2},
        "units": {"chosen": "tied"},
    }
    report = SimpleNamespace(passes=[{"name": "tie", "notes": notes}])
    assert list(pass_lines(report)) == [
        "tie: cores none -> 1,200, energy step j (fit) 1.23e-06 -> 0.00012, 1 tied"
    ]


@pytest.mark.parametrize(("chosen", "printed"), [("pack", ["pack"]), ("all", ["split", "pack"])])
def test_print_after_prints_the_image_after_the_chosen_passes(spikeport, net_py, chosen, printed):
    done = spikeport("compile", f"{net_py}:make", "-p", "split,pack", "--print-after", chosen)
    assert done.code == 0
    after = [line for line in done.out.splitlines() if line.startswith("after ")]
    assert after == [f"after {name}:" for name in printed]
    assert "\n  block 0 neurons: compartments 0 to 19, thresholds " in done.out


def test_control_characters_in_labels_are_escaped(spikeport, net_py):
    odd = ("--set", "label=\x1b[2J\ud800")
    done = spikeport("compile", f"{net_py}:make", *odd, "-p", "compact", "--print-after", "all")
    assert done.code == 0
    assert done.out.replace("\n", "").isprintable()
    assert r"\x1b[2J\ud800" in done.out


def test_print_after_a_pass_that_is_not_in_the_pipeline_is_refused(spikeport, net_py):
    done = spikeport("compile", f"{net_py}:make", "-p", "split", "--print-after", "pack")
    assert done.code == 2
    assert done.err == "error: unknown pass of this compile 'pack'; choose from: all, split\n"


def test_a_wrong_pass_exits_with_2(spikeport, net_py):
    done = spikeport("compile", f"{net_py}:make", "-p", "pack,split")
    assert (done.code, done.err) == (
        2,
        "error: pass split cannot follow pack; put it before pack\n",
    )


def test_print_after_names_a_chip_file_whose_pipeline_is_wrong(spikeport, net_py, tmp_path):
    file = chip_file(tmp_path / "own.toml", pipeline="foo")
    done = spikeport("compile", f"{net_py}:make", "--chip", file, "--print-after", "all")
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith(f"error: {file}: not a chip:\n  pipeline: unknown pass")
