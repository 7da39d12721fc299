"""Tables that the commands print."""

from types import SimpleNamespace

from rich.console import Console

from spikeport.commands.run import show_outcome
from spikeport.commands.tables import resource_table
from spikeport.experiments.options import Outcome
from spikeport.hardware_models.chip import get
from spikeport.hardware_models.limits import Usage


def test_the_resources_of_a_full_chip_are_whole_on_eighty_columns():
    def used(of, axons, bits):
        return {
            "compartment profiles": Usage(of, "compartment profiles", 1, 1024, ""),
            "out axons": Usage(of, "out axons", axons - 1, axons, ""),
            "synapse bits": Usage(of, "synapse bits", bits - 8192, bits, "bit"),
        }

    report = SimpleNamespace(
        chip=get("loihi"),
        cores=[SimpleNamespace(label=f"core {i}") for i in range(128)],
        resources=lambda: used("chip", 524_288, 128 * 2**20),
        fullest=lambda: used("core 127", 4096, 2**20),
    )
    console = Console(width=80)
    with console.capture() as printed:
        console.print(resource_table(report))
    assert "16,383 / 16,384 KiB" in printed.get()
    assert "524,287 / 524,288" in printed.get()
    assert "…" not in printed.get()


def test_metrics_of_parts_are_named_line_by_line(tmp_path, capsys):
    phases = [
        {"name": "walk", "success": True, "behind_m": 0.1},
        {"name": "draw", "success": False},
    ]
    result = {"experiment": "switch", "backend": "native", "metrics": {"phases": phases}}
    show_outcome(Outcome(result, report=None, activity=None), tmp_path)
    printed = [line.strip() for line in capsys.readouterr().out.splitlines()]
    first = next(i for i, line in enumerate(printed) if line.startswith("phases"))
    assert printed[first].split(maxsplit=1)[1] == "walk: success yes, behind_m 0.1"
    assert printed[first + 1] == "draw: success no"
