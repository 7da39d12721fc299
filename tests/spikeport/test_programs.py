"""Programs that are run to their end."""

import signal
import sys
import threading
import time
from pathlib import Path

import pytest

from spikeport.errors import BackendError
from spikeport.pacing import later
from spikeport.programs import output_of


def run(script: str, limit_s: float = 60.0) -> str:
    return output_of([sys.executable, "-c", script], "not built", limit_s)


def test_the_output_of_a_program_is_returned(tmp_path: Path) -> None:
    assert run("print('made')") == "made\n"
    assert output_of(["pwd"], "not built", 60.0, tmp_path).strip() == str(tmp_path)


@pytest.mark.parametrize(
    ("script", "message"),
    [
        ("import sys; sys.exit('no such file\\nmore')", "not built: no such file"),
        ("raise SystemExit(3)", "not built: exit code 3"),
    ],
)
def test_the_error_of_a_program_has_the_first_line_of_its_reason(script: str, message: str) -> None:
    with pytest.raises(BackendError, match=f"^{message}$"):
        run(script)


def test_a_program_that_does_not_start_is_named(tmp_path: Path) -> None:
    (program := tmp_path / "odd").write_bytes(b"\0")
    program.chmod(0o700)
    with pytest.raises(BackendError, match=f"^not built: {program}: Exec format error$"):
        output_of([str(program)], "not built", 60.0)


def is_running(process_id: int) -> bool:
    """Return whether a process goes on; one that nobody has waited for yet does not."""
    try:
        state = Path(f"/proc/{process_id}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state not in "ZX"


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("interrupted", [False, True])
def test_a_program_that_is_given_up_leaves_no_process_behind(
    interrupted: bool, tmp_path: Path
) -> None:
    child = "import time; time.sleep(100)"
    script = (
        "import subprocess, sys, time;"
        f"p = subprocess.Popen([sys.executable, '-c', {child!r}]);"
        f"open({str(tmp_path / 'pid')!r}, 'w').write(str(p.pid)); time.sleep(100)"
    )
    main = threading.get_ident()

    def interrupt() -> None:
        while not (tmp_path / "pid").exists() or not (tmp_path / "pid").read_text():
            time.sleep(0.01)
        signal.pthread_kill(main, signal.SIGINT)

    if interrupted:
        with pytest.raises(KeyboardInterrupt), later(0.1, interrupt):
            run(script)
    else:
        with pytest.raises(BackendError, match=r"^not built within 2 s$"):
            run(script, limit_s=2.0)
    process_id, until = int((tmp_path / "pid").read_text()), time.monotonic() + 10
    while is_running(process_id) and time.monotonic() < until:
        time.sleep(0.01)
    assert not is_running(process_id)
