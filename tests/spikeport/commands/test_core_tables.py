"""Tables of every core and every module."""

from dataclasses import replace

import pytest

from spikeport.commands.console import Console
from spikeport.commands.core_tables import core_table, module_table
from spikeport.commands.tables import resource_table
from spikeport.compile.image.expected import Rates, expected_activity
from spikeport.compile.image.modules import by_module, modules
from spikeport.compile.pipeline import compile_network
from spikeport.compile.report.report import Modules
from spikeport.counted import in_kib
from spikeport.find_network import find_network


@pytest.fixture
def compilation(net_py):
    return compile_network(find_network(f"{net_py}:make", ["label=[x]"]))


def lines(table):
    console = Console(width=200)
    with console.capture() as printed:
        console.print(table)
    return printed.get().splitlines()


def test_the_row_of_a_core_has_its_number_content_and_counts(compilation):
    (core,) = compilation.report.cores
    found = lines(core_table(compilation.report, None))
    (row,) = (line.split() for line in found if line.strip().startswith("0 "))
    assert row[-4:] == [
        f"{core.compartments:,}",
        f"{core.in_axons:,}",
        f"{core.out_axons:,}",
        in_kib(core.synapse_bits),
    ]
    assert "[x]" in " ".join(row)


def test_memory_is_rounded_as_in_the_table_of_resources(compilation):
    (core,) = compilation.report.cores
    report = replace(compilation.report, cores=(core._replace(synapse_bits=12_736),))  # 1.55 KiB
    resources = next(line for line in lines(resource_table(report)) if "synapse bits" in line)
    assert "2 / 128 KiB" in resources
    row = next(line for line in lines(core_table(report, None)) if line.strip().startswith("0 "))
    assert row.split()[-1] == "2"


def test_energies_have_a_column_for_each_calibration(compilation):
    activity = expected_activity(compilation.image, Rates(100.0, {}))
    text = "\n".join(lines(core_table(compilation.report, activity)))
    for calibration in compilation.report.chip.calibrations:
        assert f"energy / step, {calibration.name}" in text


def test_a_module_has_a_row_with_the_energy_of_its_step(compilation):
    image, chip = compilation.image, compilation.report.chip
    counted = Modules(modules(image), expected_activity(by_module(image), Rates(100.0, {})))
    text = "\n".join(lines(module_table(chip, counted)))
    for name in modules(image):
        assert f" {name} " in text
    energies = counted.energies(chip)["nahuku-fit"]
    assert all(one.energy_step.format() in text for one in energies)
