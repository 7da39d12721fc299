"""Requests that are options of commands: limits of a budget, and imports."""

import subprocess
import sys

import pytest

from spikeport.commands.options_of_networks import Limits
from spikeport.compile.report.budget import Budget
from spikeport.errors import UsageError


def test_limits_make_a_budget() -> None:
    limits = Limits(max_cores=3, max_power_w=0.5, max_step_us=20.0)
    assert limits.budget() == Budget(cores=3, power_w=0.5, step_us=20.0)
    with pytest.raises(UsageError, match=r"^--max-power -1\.0: a budget is a positive number"):
        Limits(max_power_w=-1.0).budget()


@pytest.mark.parametrize("name", ["options_of_networks", "options_of_experiments"])
def test_options_import_no_nengo(name: str) -> None:
    code = f"import sys, spikeport.commands.{name}; sys.exit('nengo' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], timeout=60).returncode == 0
