"""Closed and full standard streams, a removed folder, no home: each in a process of its own."""

import os
import shlex
import subprocess
import sys
from pathlib import Path

WORK = "import sys; print('warned', file=sys.stderr, flush=True); print('done')"


def command(work: str, before: str = "") -> str:
    """Return a line of a shell that runs Python code as if it were a command."""
    code = f"{before}\nfrom spikeport import cli\ncli.app = lambda **_: exec({work!r})\ncli.main()"
    return shlex.join([sys.executable, "-c", code])


def done(line: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Return a line of a shell after it was run."""
    return subprocess.run(
        line, shell=True, capture_output=True, text=True, env=os.environ | environment, check=False
    )


def test_closed_error_stream_puts_nothing_into_the_output() -> None:
    assert done(f"{command(WORK)} 2>&-").stdout == "done\n"


def test_full_disk_under_the_error_stream_does_not_end_the_work() -> None:
    ended = done(f"{command(WORK)} 2>/dev/full")
    assert (ended.returncode, ended.stdout) == (0, "done\n")


def test_closed_reader_of_the_error_stream_does_not_end_the_work() -> None:
    slow = f"import time; time.sleep(.5); {WORK}"
    assert done(f"exec 3>&1; {command(slow)} 2>&1 >&3 | true").stdout == "done\n"


def test_a_log_that_cannot_be_written_does_not_end_a_server(tmp_path: Path) -> None:
    file = tmp_path / "file"
    work = (
        "from pathlib import Path; from spikeport.commands.process import say\n"
        f"say('serving'); Path({str(file)!r}).touch()"
    )
    assert "Traceback" not in done(f"{command(work)} >/dev/full").stderr
    assert file.exists()


def test_numbers_of_closed_streams_are_taken_by_no_file(tmp_path: Path) -> None:
    file = tmp_path / "file"
    work = f"import os; os.write(1, b'x'); f = open({str(file)!r}, 'w'); assert f.fileno() > 2"
    assert done(f"{command(work)} <&- >&- 2>&-").returncode == 0
    assert file.read_text(encoding="ascii") == ""


def test_letters_that_the_output_cannot_encode_are_escaped() -> None:
    assert done(command(r"print('\u03bc')"), PYTHONIOENCODING="ascii").stdout == "\\u03bc\n"


def test_a_terminal_without_a_size_is_as_wide_as_a_file() -> None:
    work = "from spikeport.commands.console import Console; Console().print('text')"
    assert done(command(work), COLUMNS="0").stdout == "text\n"


def test_a_removed_folder_is_refused(tmp_path: Path) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    ended = done(f"cd {gone}; rmdir {gone}; {command(WORK)}")
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr.endswith(
        "error: the current folder has been removed; cure: cd into one that exists\n"
    )


def test_a_user_without_a_home_is_refused() -> None:
    before = """
import os, pwd
def unknown(number): raise KeyError(number)
pwd.getpwuid = unknown
del os.environ["HOME"]
"""
    ended = done(command(WORK, before), HOME="/")
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr == (
        f"error: user {os.getuid()} has no home folder; cure: set HOME to a folder, as HOME=/tmp\n"
    )


def test_no_threads_for_numba_are_refused() -> None:
    for threads in ("0", "-1", "+0", " 0"):
        ended = done(command(WORK), NUMBA_NUM_THREADS=threads)
        assert (ended.returncode, ended.stdout) == (2, "")
        assert ended.stderr == (
            f"error: NUMBA_NUM_THREADS is {threads}, and numba needs one thread at least; "
            "cure: unset NUMBA_NUM_THREADS\n"
        )
    assert done(command(WORK), NUMBA_NUM_THREADS="--1").stdout == "done\n"


def test_a_notebooks_backend_of_matplotlib_is_not_used() -> None:
    work = "import matplotlib.pyplot as plt; print(plt.get_backend())"
    backend = "module://matplotlib_inline.backend_inline"
    assert done(command(work), MPLBACKEND=backend).stdout == "agg\n"


def test_an_unknown_backend_of_matplotlib_is_refused() -> None:
    ended = done(command(WORK), MPLBACKEND="zz")
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr == (
        "error: MPLBACKEND is zz, which matplotlib does not know; cure: unset MPLBACKEND\n"
    )
