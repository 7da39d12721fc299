"""Figures that documents state, compared with results."""

import json
import subprocess

import figures
import pytest
import stated
from figure_runs import PICTURES, QUIET_POLICY, RUNS, TRAINING
from stated import (
    STATED,
    Stated,
    cores_of_the_lean_arm,
    joined,
    span,
    the_demo,
    the_switch,
    the_switch_on_its_own_feet,
    values,
)

DOCUMENT = "walks.md"
TEXT = "# Walks\n\nOf five robots the worst is 4.9 mm\noff its path.\n\n| line | 3.4 4.9 |\n"


def walks(first_m=0.0034):
    """Return the results of two walks, the second seed first."""
    return [
        {"settings": {"path": "line"}, "seeds": {"run": seed, "network": 0}, "metrics": {"m": m}}
        for seed, m in ((1, 0.0049), (0, first_m))
    ]


def row(walk):
    yield f"| line | {joined(values(walk, 'metrics.m', path='line'), 1, times=1000)} |"


def worst(walk):
    yield f"the worst is {1000 * max(values(walk, 'metrics.m')):.1f} mm off"


@pytest.fixture
def root(tmp_path):
    (tmp_path / DOCUMENT).write_text(TEXT)
    return tmp_path


def checked(root, capsys, makes, results):
    """Return the exit code of a check of one statement, and what it printed."""
    code = figures.check(results, [Stated(DOCUMENT, makes)], root)
    return code, capsys.readouterr().out.splitlines()


@pytest.mark.parametrize("makes", [row, worst])
def test_a_statement_is_found_in_a_table_and_across_lines(root, capsys, makes):
    summary = "1 of 1 statements have results; 0 sentences differ"
    assert checked(root, capsys, makes, {"walk": walks()}) == (0, [summary])


def test_a_figure_that_differs_is_shown_beside_the_closest_line(root, capsys):
    assert checked(root, capsys, row, {"walk": walks(0.0036)}) == (
        1,
        [
            "walks.md: row",
            "  results: | line | 3.6 4.9 |",
            "  closest: | line | 3.4 4.9 |",
            "1 of 1 statements have results; 1 sentences differ",
        ],
    )


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("10 falls, the drawn 8", "0 falls, the drawn 8"),
        ("is 11.8 mm off", "1.8 mm off"),
        ("has 3,409 spikes", "409 spikes"),
        ("moves by -0.5 m", "0.5 m"),
        ("phases_done 42 ", "phases_done 4"),
        ("on 4.7 cores", "on 4"),
    ],
)
def test_a_part_of_a_longer_number_states_nothing(root, capsys, text, sentence):
    (root / DOCUMENT).write_text(text)

    def makes(walk):
        yield sentence

    assert checked(root, capsys, makes, {"walk": walks()})[0] == 1
    (root / DOCUMENT).write_text(f"It says: {sentence}. Then it ends.")
    assert checked(root, capsys, makes, {"walk": walks()})[0] == 0


def test_a_run_without_results_is_named(root, capsys):
    assert checked(root, capsys, row, {}) == (
        1,
        ["not run: walk (row, walks.md)", "0 of 1 statements have results; 0 sentences differ"],
    )


def fallen(walk):
    stated._no_falls(walk)
    yield "no robot fell"


def test_a_statement_that_results_do_not_allow_is_named_and_the_others_are_checked(root, capsys):
    results = {"walk": [{**one, "metrics": {"falls": 1, "m": 0.0049}} for one in walks()]}
    both = [Stated(DOCUMENT, fallen), Stated(DOCUMENT, worst)]
    assert figures.check(results, both, root) == 1
    assert capsys.readouterr().out.splitlines() == [
        "fallen (walks.md): cannot be stated: ValueError: robots fell in 2 runs: 2",
        "1 of 2 statements have results; 0 sentences differ",
    ]


def test_a_statement_of_one_run_names_the_number_of_others(root, capsys):
    code, lines = checked(root, capsys, the_demo_alone, {"walk": walks()})
    assert (code, lines[0]) == (
        1,
        "the_demo_alone (walks.md): cannot be stated: ValueError: runs: one is expected, "
        "there are 2",
    )


def the_demo_alone(walk):
    yield from the_demo(walk)


def test_values_are_in_the_order_of_seeds_and_spans_go_from_least_to_largest():
    assert values(walks(), "metrics.m") == [0.0034, 0.0049]
    assert span([0.016, 0.014, 0.020], times=1000) == "14 to 20"


def test_results_of_runs_and_of_sweeps_are_kept_without_speeds(tmp_path):
    run, sweep = tmp_path / "run", tmp_path / "sweep"
    (sweep / "points").mkdir(parents=True)
    run.mkdir()
    result = {"metrics": {"reaches": 54, "real_time_factor": 9.0}, "command": ["spikeport"]}
    (run / "result.json").write_text(json.dumps(result))
    for seed in range(2):
        (sweep / "points" / f"seed={seed}.json").write_text(json.dumps(result))
    assert figures.results_in(run) == [{"metrics": {"reaches": 54}}]
    assert figures.results_in(sweep) == 2 * [{"metrics": {"reaches": 54}}]
    assert figures.results_in(tmp_path) == []


def test_only_sweeps_and_evaluations_are_asked_for_again_and_pictures_go_to_the_documents(
    tmp_path, monkeypatch
):
    """A run that fails is not kept; sweeps find their missing and failed points by themselves."""
    asked = []

    def call(line, **_):
        asked.append(line[3:5])
        folder = tmp_path / "build" / line[-1].rpartition("/")[2]
        if "broken" not in folder.name:
            (folder / "points").mkdir(parents=True, exist_ok=True)
            (folder / "figure.png").write_bytes(b"drawn")
            result = "points/0.json" if line[3] == "sweep" else "result.json"
            whole = {"metrics": {"reaches": 54}, "command": ["spikeport", *line[3:]]}
            (folder / result).write_text(json.dumps(whole))
            if line[3] != "run":
                (folder / "sweep.json").touch()
        return figures.subprocess.CompletedProcess(line, int("broken" in folder.name))

    runs = {"reach": "run reach", "many": "sweep reach", "broken": "run draw"}
    runs["falls"] = "evaluate walk"
    monkeypatch.setattr(figures, "ROOT", tmp_path)
    monkeypatch.setattr(figures, "RUNS", runs)
    monkeypatch.setattr(figures, "PICTURES", {"reach": "reach.png"})
    monkeypatch.setattr(figures, "FOLDERS", tmp_path / "build")
    monkeypatch.setattr(figures, "RESULTS", tmp_path / "kept")
    monkeypatch.setattr(figures.subprocess, "run", call)
    assert figures.run(runs) == 1
    assert asked == [command.split() for command in runs.values()]
    assert figures.run(["reach", "many", "falls"]) == 0
    assert asked[len(runs) :] == [["sweep", "reach"], ["evaluate", "walk"]]
    result = [{"metrics": {"reaches": 54}}]
    assert figures.read_results(tmp_path / "kept") == dict.fromkeys(
        ("reach", "many", "falls"), result
    )
    assert [path.name for path in tmp_path.glob("*.png")] == ["reach.png"]
    assert (tmp_path / "reach.png").read_bytes() == b"drawn"
    runs["reach"] = "run reach --set box=large"
    (tmp_path / "kept" / "reach.json").unlink()
    assert figures.run(["reach"]) == 1
    assert not (tmp_path / "kept" / "reach.json").exists()


def test_a_missing_policy_is_reported_with_the_command_that_makes_it(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(figures, "ROOT", tmp_path)
    monkeypatch.setattr(figures, "FOLDERS", tmp_path)
    monkeypatch.setattr(figures, "RESULTS", tmp_path)
    monkeypatch.setattr(figures.subprocess, "run", pytest.fail)
    assert figures.run(["quiet_exact"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("failed: quiet_exact: ")
    assert lines[0].endswith(f" is missing; make it with: {TRAINING}")
    assert lines[1:] == ["1 of 1 failed, see above"]


def test_the_command_that_makes_the_policy_can_be_repeated(tmp_path):
    """Its first part, the checkout of a commit, is not made a second time."""
    git = tmp_path / "git"
    git.write_text("#!/bin/sh\nmkdir -p $3 && echo made >> log\n")
    git.chmod(0o755)
    checkout, _, training = TRAINING.partition(" && ")
    for _ in range(2):
        path = {"PATH": f"{tmp_path}:/usr/bin:/bin"}
        subprocess.run(checkout, shell=True, cwd=tmp_path, env=path, check=True)
    assert (tmp_path / "log").read_text() == "made\n"
    assert training.startswith("PYTHONPATH=build/f82d95d/src ")


def test_a_run_without_its_policy_is_not_run_where_its_figures_or_picture_are_kept(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(figures, "ROOT", tmp_path)
    monkeypatch.setattr(figures, "FOLDERS", tmp_path / "build")
    monkeypatch.setattr(figures, "RESULTS", tmp_path)
    monkeypatch.setattr(figures.subprocess, "run", pytest.fail)
    (tmp_path / "quiet_exact.json").write_text("[]")
    picture = tmp_path / PICTURES["fig5b"]
    picture.parent.mkdir(parents=True)
    picture.touch()
    assert figures.run(["quiet_exact", "fig5b"]) == 3
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(": ")[:2] for line in lines[:-1]] == [
        ["not run", "quiet_exact"],
        ["not run", "fig5b"],
    ]
    assert lines[-1] == "2 of 2 not run, see above"


@pytest.mark.parametrize("card", [None, "- **step**: a\n- **late**: b\n"])
def test_a_policy_of_other_stages_is_not_used(tmp_path, monkeypatch, capsys, card):
    policy = tmp_path / QUIET_POLICY
    policy.parent.mkdir(parents=True)
    policy.touch()
    if card:
        policy.with_suffix(".md").write_text(card)
    monkeypatch.setattr(figures, "ROOT", tmp_path)
    monkeypatch.setattr(figures, "FOLDERS", tmp_path / "build")
    monkeypatch.setattr(figures, "RESULTS", tmp_path)
    monkeypatch.setattr(figures.subprocess, "run", pytest.fail)
    assert figures.run(["quiet_on"]) == 1
    assert f"was not trained by these stages; delete {policy.parent}, and make it with: " in (
        capsys.readouterr().out
    )
    policy.with_suffix(".md").write_text("- **step**: a\n- **upright**: b\n")
    assert not figures._without_policy(policy)


@pytest.fixture
def reach(tmp_path, monkeypatch):
    """Return a function that carries out `reach`, whose command leaves what is given."""
    monkeypatch.setattr(figures, "ROOT", tmp_path)
    monkeypatch.setattr(figures, "PICTURES", {})
    monkeypatch.setattr(figures, "FOLDERS", tmp_path / "build")
    monkeypatch.setattr(figures, "RESULTS", tmp_path / "kept")
    folder = tmp_path / "build" / "reach"

    def carry_out(result, kept, plan=False, code=0):
        def call(line, **_):
            folder.mkdir(parents=True, exist_ok=True)
            if plan:
                (folder / "sweep.json").touch()
            if result:
                (folder / "result.json").write_text(json.dumps(result))
            return figures.subprocess.CompletedProcess(line, code)

        monkeypatch.setattr(figures.subprocess, "run", call)
        (tmp_path / "kept").mkdir(exist_ok=True)
        (tmp_path / "kept" / "reach.json").write_text(kept)
        return figures.run(["reach"]), (tmp_path / "kept" / "reach.json").read_text()

    return carry_out


def reached(n):
    return {"metrics": {"reaches": n}, "command": ["spikeport", "run", "reach", "--out", "x"]}


def test_a_command_without_a_result_replaces_no_kept_figures(reach, capsys):
    assert reach(None, "kept") == (1, "kept")
    assert "build/reach has no result; delete it to run again" in capsys.readouterr().out


@pytest.mark.parametrize("plan", [False, True])
def test_results_of_a_finished_run_replace_no_others(reach, plan, capsys):
    code, own = reach(reached(54), "kept", plan)
    assert (code, json.loads(own)) == (0, [{"metrics": {"reaches": 54}}])
    assert reach(reached(54), own, plan) == (0, own)
    assert reach(reached(54), "newer", plan) == (1, "newer")
    assert "other results than those kept; delete it to run again" in capsys.readouterr().out


@pytest.mark.parametrize("plan", [False, True])
def test_results_that_were_never_kept_are_kept_at_the_next_try(reach, plan):
    """A sweep can have all points and still fail, or be interrupted before they are kept."""
    assert reach(reached(54), "kept", plan, code=1) == (1, "kept")
    code, own = reach(reached(54), "kept", plan)
    assert (code, json.loads(own)) == (0, [{"metrics": {"reaches": 54}}])


def test_an_unknown_run_is_refused_with_the_known_ones(capsys):
    with pytest.raises(SystemExit):
        figures.main(["run", "rech"])
    message = capsys.readouterr().err
    assert "no run 'rech'; choose from: reach_small_analytic, " in message
    assert "[]" not in message


def test_statements_and_kept_results_belong_to_known_runs():
    assert {name for one in STATED for name in one.runs} <= set(RUNS)
    assert set(figures.read_results()) <= set(RUNS)
    assert set(PICTURES) <= set(RUNS)
    assert all((figures.ROOT / picture).is_file() for picture in PICTURES.values())


def test_the_documents_state_what_was_measured(capsys):
    assert figures.check(figures.read_results()) == 0, capsys.readouterr().out


def test_a_bound_of_cores_is_that_of_the_compile():
    compiled = [{"resources": {"cores": {"used": 6, "lower_bound": 5}}}]
    assert list(cores_of_the_lean_arm(compiled)) == [
        "| the arm, lean: 4,550 neurons | 26 | 6 (5) |"
    ]


def test_the_demos_shape_error_is_not_that_of_its_phase():
    results = figures.read_results()["demo"]
    text = (figures.ROOT / "docs" / "experiments.md").read_text()
    error_m = f"{results[0]['metrics']['shape_error_rms_m']:.4g}"
    head, phase, tail = text.rpartition(error_m)
    assert phase == error_m
    assert error_m in head
    demo = Stated("docs/experiments.md", the_demo)
    assert not list(figures.differing(demo, {"demo": results}, text))
    assert len(list(figures.differing(demo, {"demo": results}, f"{head}0.9{tail}"))) == 1


def switched(*phases):
    """Return the result of a run of the switch, with its phases as a run's folder has them."""
    metrics = {"falls": 0, "shape_error_rms_m": 0.0053, "phases": list(phases)}
    return {"seeds": {"run": 0, "network": 0}, "settings": {}, "metrics": metrics}


def path(name, error_m, switch_s):
    return {"name": name, "path_error_rms_m": error_m, "switching_time_s": switch_s}


def drawing(error_m, moved_m):
    return {
        "name": "draw",
        "shape_error_rms_m": error_m,
        "pelvis_moved_m": moved_m,
        "switching_time_s": 0.028,
    }


def test_rows_of_the_switch_are_made_from_its_list_of_phases():
    phases = path("walk", 0.0046, 0.024), drawing(0.0053, 0.01), path("walk on", 0.0059, 0.025)
    assert list(the_switch([switched(*phases)])) == [
        "| shape error (mm rms) | 5.3 |",
        "| longest switch (ms) | 28 |",
        "| path error, first walk and second (cm rms) | 0.5, 0.6 |",
    ]


def test_rows_of_free_standing_leave_out_the_way_of_the_pelvis_in_the_first_drawing():
    drawings = drawing(0.0056, 0.21), drawing(0.0058, 0.02), drawing(0.0059, 0.018)
    walks = path("walk", 0.0046, 0.024), path("walk on", 0.0059, 0.025)
    phases = walks[0], *drawings, walks[1]
    assert list(the_switch_on_its_own_feet([switched(*phases)])) == [
        "| shape error of the three drawings (mm rms) | 5.6, 5.8, 5.9 |",
        "| way of the pelvis, second drawing and third (cm) | 2.0, 1.8 |",
        "| path error, first walk and second (cm rms) | 0.5, 0.6 |",
    ]
