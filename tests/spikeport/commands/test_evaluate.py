"""``spikeport evaluate``: its table, its picture, and its refusals."""

import dataclasses
import json
from types import SimpleNamespace

import pytest

from spikeport.commands.console import Console
from spikeport.commands.evaluate import screen_table
from spikeport.experiments.evaluate import episode
from spikeport.experiments.evaluate.interval import of_mean, of_share
from spikeport.experiments.evaluate.measures import MEASURES
from spikeport.experiments.evaluate.rows import ROWS
from spikeport.experiments.evaluate.table import TableRow
from spikeport.experiments.sweep import run as execution
from spikeport.experiments.sweep.run import Failure
from spikeport.networks import walking_policy

WALK = ("evaluate", "walk", "--backend", "analytic", "--seconds", "4")
FILES = "figure.png, points, result.json, sweep.json, table.md"


@pytest.fixture
def here(monkeypatch):
    """Run episodes in this process, one after the other; episodes on boxes fail."""

    def run(points, run_episode, folder, _scheduler, _n_workers, _progress, counted):
        assert counted == "episodes"
        missing = [point for point in points if not folder.holds(point)]
        for point in missing:
            if "terrain" not in point.place:
                folder.write(point, run_episode(point, ""))
        return [Failure(point, "no boxes") for point in missing if "terrain" in point.place]

    monkeypatch.setattr(execution, "run", run)


@pytest.mark.slow
def test_an_evaluation_leaves_a_table_a_picture_and_every_episode(spikeport, here, tmp_path):
    rows = ("--row", "strength=0.2", "--row", "terrain=boxes:0.01")
    done = spikeport(*WALK, *rows, "--episodes", 2, "--out", tmp_path)
    assert done.code == 1
    assert "failed: terrain=boxes%3A0.01,seed=0: no boxes\n" in done.out
    assert done.out.splitlines()[0] == "the exact policy, 2 episodes of 4 s a row"
    assert (
        f"intervals of 95 %, and all figures: table.md\nwritten: {tmp_path}/ ({FILES})\n"
        in done.out
    )
    result = json.loads((tmp_path / "result.json").read_text())
    nominal, weak, boxes = result["rows"]
    assert (nominal["row"], nominal["falls"], nominal["fell"]["n"]) == ("nominal", 0, 2)
    assert nominal["speed_error_m_s"]["n"] == 2
    assert (weak["row"], weak["falls"], weak["speed_error_m_s"]) == ("strength=0.2", 2, None)
    assert (boxes["row"], boxes["falls"], boxes["fell"]) == ("terrain=boxes:0.01", 0, None)
    table = (tmp_path / "table.md").read_text().splitlines()
    assert table[2].startswith("| nominal | 0 of 2 | 0-66 % | 0.0")
    assert table[3] == "| strength=0.2 | 2 of 2 | 34-100 % |" + " - |" * 11


def test_the_table_shows_names_headings_and_means_uncut_in_80_columns():
    means = dict.fromkeys(MEASURES, of_mean([0.25, 0.25]))
    rows = [TableRow(row, 100, of_share(100, 200), means) for row in ROWS]
    console = Console(width=80)
    with console.capture() as captured:
        console.print(screen_table(rows))
    words = captured.get().split()
    assert "…" not in "".join(words)
    assert {"perturbation", "falls", "yaw", "error,", "weights"} <= set(words)
    # No setting of a row is cut, or goes on in the next line.
    assert {part for one in rows for part in one.name.split()} <= set(words)
    assert words.count("0.250") == len(ROWS) * 4


@pytest.mark.parametrize(
    ("asked", "title"),
    [
        (("--episodes", 1), "the exact policy, 1 episode of 4 s a row"),
        (
            ("--episodes", 1, "--set", "policy=networks/policies/h1_walk.npz"),
            "the exact policy of networks/policies/h1_walk.npz, 1 episode of 4 s a row",
        ),
        (
            ("--episodes", 1, "--backend", "native"),
            "the spiking policy on native, 1 episode of 4 s a row",
        ),
        (
            ("--episodes", 1, "--backend", "native", "--set", "policy=mlp"),
            "the exact policy, 1 episode of 4 s a row",
        ),
    ],
)
def test_the_title_of_the_table_names_the_policy(
    spikeport, here, monkeypatch, tmp_path, asked, title
):
    walker = SimpleNamespace(walk=lambda *_: None)
    monkeypatch.setattr(episode, "find_walker", lambda *_: walker)
    monkeypatch.setattr(episode, "measure", lambda _: {"falls": 1, **dict.fromkeys(MEASURES)})
    done = spikeport(*WALK, *asked, "--row", "push=1", "--out", tmp_path / "out")
    assert (done.code, done.err) == (0, "")
    assert done.out.splitlines()[0] == title


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("evaluate", "reach"), "unknown experiment to evaluate 'reach'; choose from: walk"),
        ((*WALK, "--row", "push=x"), "--row push=x: expected a number"),
        (
            (*WALK, "--backend", "gpu"),
            "unknown backend of walk 'gpu'; choose from: analytic, board, "
            "native, native-threads, nengo-loihi, reference",
        ),
        (
            (*WALK, "--backend", "replay"),
            "backend replay: a record is of one run, not of an evaluation",
        ),
        (
            (*WALK, "--set", "push=0.8"),
            "--set push: it would perturb the nominal row too; cure: --row push=0.8",
        ),
        (
            (*WALK, "--seed", "1", "--episodes", "1000", "--row", "push=1"),
            "--seed 1: 1,000 episodes include seed 1000, that of the gait which neurons are made "
            "for; cure: --seed 1001",
        ),
        (
            (*WALK, "--set", "n_neurons=20"),
            "n_neurons: does nothing on backend 'analytic', which has no neurons; cure: --backend "
            "native, or leave it out",
        ),
        (
            (*WALK, "--set", "silence=0.1"),
            "--set silence: an evaluation draws commands, follows no path, silences no neurons and "
            "shows no robot; cure: leave it out",
        ),
        (
            (*WALK, "--set", "appearance=primitive"),
            "--set appearance: an evaluation draws commands, follows no path, silences no neurons "
            "and shows no robot; cure: leave it out",
        ),
        (
            (*WALK[:-1], "3"),
            "--seconds 3: the measures need episodes longer than 3 s; cure: leave it out, for "
            "the default of 20 s",
        ),
        (
            (*WALK[:-1], "3.001"),
            "--seconds 3.001: the measures need episodes longer than 3 s; cure: leave it out, for "
            "the default of 20 s",
        ),
        (
            (*WALK[:-1], "4.002"),
            "--seconds 4.002: must be a whole number of steps of 0.005 s; cure: 4.0",
        ),
        (
            (*WALK, "--row", "robot_model=menagerie"),
            "Menagerie's unitree_h1 is not in {root}/unitree_h1, and spikeport downloads nothing; "
            "set MENAGERIE_ROOT to a checkout of github.com/google-deepmind/mujoco_menagerie",
        ),
        (
            (*WALK, "--row", "push=1", "--scheduler", "tls://10.0.0.1:8786", "--workers", "4"),
            "--workers 4: a cluster has workers of its own; leave it out, or leave --scheduler out",
        ),
        (
            (*WALK, "--episodes", "100000", "--row", "push=1"),
            "an evaluation of 200,000 episodes, limit 100,000; cure: fewer --row or --episodes",
        ),
        (
            (*WALK, "--seed", "4294967295", "--episodes", "2"),
            "--seed 4294967295: the last of 2 episodes has seed 4294967296, limit 4294967295; "
            "cure: a smaller --seed",
        ),
    ],
)
def test_evaluations_that_are_not_possible_are_refused(
    spikeport, here, monkeypatch, tmp_path, arguments, message
):
    monkeypatch.setenv("MENAGERIE_ROOT", str(tmp_path))
    done = spikeport(*arguments, "--out", tmp_path / "out")
    assert done == (2, "", f"error: {message.format(root=tmp_path)}\n")
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a$\\frac$.npz", "p\udcff.npz"])
def test_the_file_of_a_policy_may_have_any_name(spikeport, here, tmp_path, name):
    policy, out = tmp_path / name, tmp_path / "out"
    walking_policy.load().save(policy)
    options = ("--row", "push=0.5", "--set", f"policy={policy}", "--out", out)
    done = spikeport(*WALK, "--episodes", 1, *options)
    assert done.code == 0
    assert f"({FILES})\n" in done.out


@pytest.mark.slow
def test_an_evaluation_does_not_go_on_with_another_policy_in_its_file(spikeport, here, tmp_path):
    policy, out = tmp_path / "policy.npz", tmp_path / "out"
    shipped = walking_policy.load()
    shipped.save(policy)
    command = (*WALK, "--episodes", 1, "--row", "push=0.5", "--set", f"policy={policy}")
    assert spikeport(*command, "--out", out).code == 0
    dataclasses.replace(shipped, action_scale_rad=0.9 * shipped.action_scale_rad).save(policy)
    done = spikeport(*command, "--out", out)
    assert (done.code, done.out) == (2, "")
    assert f"{out}: was begun with other contents of {policy} (digest " in done.err


@pytest.mark.slow
def test_workers_run_the_episodes_and_a_second_evaluation_keeps_finished_ones(spikeport, tmp_path):
    asked = (*WALK, "--episodes", 1, "--row", "push=0.5", "--workers", 1)
    assert spikeport(*asked, "--out", tmp_path).code == 0
    written = {path: path.stat().st_mtime_ns for path in (tmp_path / "points").iterdir()}
    assert len(written) == 2
    assert spikeport(*asked, "--out", tmp_path).code == 0
    assert {path: path.stat().st_mtime_ns for path in written} == written
