"""The commands of the README's first page, which print the lines shown there."""

import re
from pathlib import Path

import pytest

from spikeport.cli import main

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def run(monkeypatch, command):
    monkeypatch.setattr("sys.argv", command.split())
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code


@pytest.mark.slow
@pytest.mark.usefixtures("nengo_defaults")
@pytest.mark.filterwarnings("ignore:FigureCanvasAgg is non-interactive")
def test_the_first_run_prints_the_lines_of_the_readme(monkeypatch, capsys, tmp_path):
    (command,) = re.findall(r"^    (spikeport simulate examples/.*) --out .*$", README, re.M)
    monkeypatch.chdir(ROOT)
    run(monkeypatch, f"{command} --out {tmp_path / 'channel'}")
    printed = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    block = README[README.index("  probe      values") :].partition("```")[0]
    *lines, written = block.splitlines()
    for line in lines:
        assert line in printed
    assert printed[-1].endswith(written.partition("/channel/")[2])


@pytest.mark.slow
def test_the_readers_own_model_compiles_and_simulates(monkeypatch, tmp_path, capsys):
    (text,) = re.findall(r"```python\n# my_model.py\n(.*?)```", README, re.S)
    monkeypatch.chdir(tmp_path)
    Path("my_model.py").write_text(text, encoding="utf-8")
    commands = re.findall(r"^    (spikeport (?:compile|simulate) my_model.py) ", README, re.M)
    assert set(commands) == {"spikeport compile my_model.py", "spikeport simulate my_model.py"}
    run(monkeypatch, "spikeport compile my_model.py")
    run(monkeypatch, "spikeport simulate my_model.py --seconds 0.05")
    assert "fits chip 'loihi' on 1 core" in capsys.readouterr().out
    assert list(tmp_path.glob("runs/my_model-*/figure.png"))
