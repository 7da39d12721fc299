"""Programs and commands of the pages that a reader can run as they stand."""

import re
from pathlib import Path

import numpy as np
import pytest

from spikeport import cache
from spikeport.cli import main
from spikeport.compile.check import memory
from spikeport.robot.estimator import simulated_sensors
from tests.examples.test_readme import README


@pytest.fixture(scope="module")
def docs(root: Path) -> Path:
    return root / "docs"


def test_the_program_of_the_estimators_runs_and_estimates_the_motion(docs: Path) -> None:
    page = (docs / "estimators.md").read_text(encoding="utf-8")
    (program,) = re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    names: dict[str, object] = {}
    exec(program, names)
    plant, state = names["plant"], names["state"]
    assert np.abs(state.base_position - plant.state.base_position).max() < 0.05
    for name in re.findall(r"`(ROUGH|EXACT)`", page):
        assert hasattr(simulated_sensors, name)


@pytest.mark.slow
@pytest.mark.usefixtures("nengo_defaults")
def test_the_first_commands_of_nir_need_only_the_model_of_the_first_page(
    docs: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("nir", reason="nir is absent: pip install -e '.[nir]'")
    start = (docs / "start.md").read_text(encoding="utf-8")
    (model,) = re.findall(r"```python\n# my_model.py\n(.*?)```", start, re.DOTALL)
    assert model in README
    monkeypatch.chdir(tmp_path)
    Path("my_model.py").write_text(model, encoding="utf-8")
    page = (docs / "nir.md").read_text(encoding="utf-8")
    commands = re.findall(r"^    (spikeport .*?my_model.*?) *(?:#.*)?$", page, re.MULTILINE)
    assert len(commands) == 4
    for command in commands:
        monkeypatch.setattr("sys.argv", command.split())
        with pytest.raises(SystemExit) as end:
            main()
        assert not end.value.code
    assert "equal neuron-steps, chip and NIR's equations" in capsys.readouterr().out


READ = re.compile(r"environ(?:\.get\(|\[)\"([A-Z_]+)\"")
OF_THE_SYSTEM = {"COLUMNS", "DISPLAY", "WAYLAND_DISPLAY", "NUMBA_NUM_THREADS"}
"""Variables that others set: a terminal, a display, a worker."""


def test_the_table_of_environment_variables_has_those_that_the_package_reads(
    docs: Path, root: Path
) -> None:
    folders = ("src/spikeport", "backends", "compile", "experiments", "networks", "robot")
    files = [path for folder in folders for path in (root / folder).rglob("*.py")]
    read = {name for path in files for name in READ.findall(path.read_text(encoding="utf-8"))}
    assert {"MENAGERIE_ROOT", "MUJOCO_GL"} <= read
    page = (docs / "files.md").read_text(encoding="utf-8").partition("## Environment variables")[2]
    listed = set(re.findall(r"^\| `([A-Z_]+)` \|", page, re.MULTILINE))
    assert (read - OF_THE_SYSTEM) | {memory.VARIABLE, cache.FOLDER} <= listed


SERVER = re.compile(r"^ {4}spikeport (?:board|robot) serve .*?&(?: *#.*)?$", re.MULTILINE)


def test_every_server_that_the_pages_start_in_the_background_ends_by_itself(
    docs: Path, root: Path
) -> None:
    pages = [root / "README.md", *docs.rglob("*.md")]
    servers = [one for page in pages for one in SERVER.findall(page.read_text(encoding="utf-8"))]
    assert len(servers) >= 9
    assert [one for one in servers if "--once" not in one] == []
