"""``python -m spikeport``, which is the command line."""

import subprocess
import sys

from spikeport import __version__


def test_python_m_spikeport_is_the_command_line() -> None:
    command = [sys.executable, "-m", "spikeport", "--version"]
    found = subprocess.run(command, capture_output=True, text=True, check=True)
    assert found.stdout == f"spikeport {__version__}\n"
