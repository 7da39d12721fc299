"""The command line as a whole; each command is tested in tests/spikeport/commands."""

import os
import subprocess
import sys

import pytest
from typer.main import get_command

from spikeport import __version__
from spikeport.cli import app
from spikeport.cli_experiments import experiments_app
from spikeport.cli_networks import networks_app

COMPILE_OPTIONS = ["--chip", "--set", "--out", "--json", "--rate-hz", "--loss", "--max-cores"]
COMPILE_OPTIONS += ["--max-power", "--max-step-us", "--cores", "--explain"]
RUN_OPTIONS = ["--backend", "--chip", "--seed", "--seconds", "--set", "--out", "--overwrite"]
RUN_OPTIONS.append("--video")
COMMAND = "typer.core.TyperGroup.invoke"
"""The method that runs a command."""


def test_the_version_is_printed(spikeport):
    assert spikeport("--version") == (0, f"spikeport {__version__}\n", "")


def test_help_is_printed_with_exit_code_2_if_no_command_is_given(spikeport):
    done = spikeport()
    assert done.code == 2
    assert "Usage: spikeport" in done.out


@pytest.mark.parametrize(
    ("command", "options"),
    [
        ([], ["--version", "compile", "diff", "run", "chips", "backends", "doctor"]),
        (["compile"], COMPILE_OPTIONS),
        (["diff"], ["--help"]),
        (
            ["run"],
            RUN_OPTIONS,
        ),
        (["chips"], ["--help"]),
        (["backends"], ["--help"]),
        (["doctor"], ["--help"]),
    ],
)
def test_help_names_every_option(spikeport, command, options):
    done = spikeport(*command, "--help")
    assert done.code == 0
    assert [option for option in options if option not in done.out] == []


@pytest.mark.parametrize(
    "arguments",
    [
        ["fly"],
        ["compile"],
        ["run"],
        ["compile", "arm", "--core", "3"],
        ["run", "reach", "--seed", "-1"],
        ["run", "reach", "--seed", str(2**32)],
        ["run", "reach", "--seed", "one"],
        ["run", "reach", "--seconds", "long"],
    ],
)
def test_wrong_commands_options_and_values_exit_with_2(spikeport, arguments):
    done = spikeport(*arguments)
    assert done.code == 2
    assert "Usage: spikeport" in done.err


@pytest.mark.slow
def test_output_that_its_reader_closes_early_gives_no_traceback(start):
    process = start("chips")
    process.stdout.close()
    assert process.stderr.read() == ""
    process.stderr.close()
    process.wait(timeout=60)


def test_help_does_not_import_nengo():
    code = (
        "import sys; from spikeport import cli\n"
        "try: cli.app(['--help'])\n"
        "except SystemExit as end: assert not end.code; sys.exit('nengo' in sys.modules)\n"
        "sys.exit(3)"
    )
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, timeout=60)
    assert (process.returncode, b"Usage" in process.stdout) == (0, True), process.stderr


def test_output_to_a_full_disk_gives_an_error_of_one_line():
    code = "from spikeport import cli; cli.app = lambda **_: print('x'); cli.main()"
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-c", code],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONUNBUFFERED": ""},  # the last flush fails, and not the first
        )
    assert (done.returncode, done.stderr) == (1, "error: system: No space left on device\n")


@pytest.mark.parametrize(
    ("where", "error", "said"),
    [
        ("cli.app", "KeyboardInterrupt", "no result was completed"),
        (COMMAND, "KeyboardInterrupt", "no result was completed"),
        (COMMAND, "KeyboardInterrupt('points are kept')", "points are kept"),
        # Python's own error of an interrupt in the making of a class, before 3.12.
        (COMMAND, "RuntimeError('class') from KeyboardInterrupt()", "no result was completed"),
    ],
)
def test_an_interrupt_gives_an_error_of_one_line(where, error, said):
    code = (
        "import typer.core; from spikeport import cli\n"
        f"def interrupted(*_, **__): raise {error}\n"
        f"{where} = interrupted; cli.main()"
    )
    done = subprocess.run([sys.executable, "-c", code, "chips"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (130, f"error: interrupted; {said}\n")


@pytest.mark.parametrize(
    "command",
    [
        ("compile", "NET:make", "--out", "LONG"),
        ("train", "walk", "--out", "LONG"),
        ("calibrate", "reach", "--out", "LONG/file.npz"),
        ("view", "LONG"),
        ("show", "LONG"),
    ],
)
def test_names_that_are_too_long_are_wrong_use(spikeport, net_py, tmp_path, command):
    long = str(tmp_path / ("n" * 300))
    words = [one.replace("NET", str(net_py)).replace("LONG", long) for one in command]
    done = spikeport(*words)
    assert (done.code, done.out) == (2, "")
    assert long in done.err


def test_help_lists_the_commands_on_networks_first_and_those_on_experiments_next():
    networks, experiments = (
        [command.name for command in one.registered_commands]
        for one in (networks_app, experiments_app)
    )
    assert {"compile", "convert"} <= set(networks)
    assert {"run", "sweep"} <= set(experiments)
    listed = list(get_command(app).commands)
    assert listed[: len(networks + experiments)] == networks + experiments
