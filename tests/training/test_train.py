import contextlib
import json
from dataclasses import replace

import pytest

pytest.importorskip("torch")
pytest.importorskip("rsl_rl")

import torch

from spikeport.errors import UsageError
from spikeport.training import checkpoint, evaluate
from spikeport.training import train as train_module
from spikeport.training.curriculum import STAGES, without_hidden_noise
from spikeport.training.learner import LearnerOptions
from spikeport.training.train import TrainOptions, train

SMALL = LearnerOptions(robots=8, horizon=4)


def silent(_what, _share):
    """Report nothing."""


def differing(one, other):
    """Return the names of the weights that are not the same to the last bit."""
    return [name for name in one if not torch.equal(one[name], other[name])]


@pytest.fixture
def options(tmp_path, monkeypatch):
    """Return options of three segments with an update each; the last one has hidden noise."""
    monkeypatch.setattr(evaluate, "EPISODE_STEPS", 3)
    noisy = next(stage for stage in STAGES if stage.hidden_noise)
    stages = (STAGES[0], replace(noisy, first_step=64))
    return TrainOptions(
        tmp_path / "run",
        seed=3,
        steps=96,
        learner=SMALL,
        updates_per_segment=1,
        stages=stages,
        evaluate_every=99,
        episodes=2,
        workers=1,
    )


class KilledError(Exception):
    pass


def killed_after(share):
    def progress(_what, done):
        if done is not None and done > share:
            raise KilledError

    return progress


def weights(options):
    last = checkpoint.load(checkpoint.latest(options.folder))
    return last.learner["actor_state_dict"]


def test_a_resumed_run_ends_with_the_weights_of_an_uninterrupted_one(options, tmp_path):
    whole = replace(options, folder=tmp_path / "whole")
    train(whole, silent)
    with pytest.raises(KilledError):
        train(options, killed_after(0.5))
    assert checkpoint.latest(options.folder).name == "00001.pt"
    train(options, silent)
    assert differing(weights(whole), weights(options)) == []


@pytest.mark.slow
def test_all_of_several_workers_start_over_with_the_weights_that_the_first_one_kept(options):
    options = replace(options, workers=2)
    train(options, silent)
    whole = weights(options)
    for segment in (2, 3):
        checkpoint.path_of(options.folder, segment).unlink()
    train(options, silent)
    assert differing(whole, weights(options)) == []


def test_training_changes_the_weights_and_logs_every_segment(options):
    log = train(options, silent)
    assert [(entry["step"], entry["stage"]) for entry in log] == [
        (32, "step"),
        (64, "step"),
        (96, "noisy"),
    ]
    first, last = (
        checkpoint.load(checkpoint.path_of(options.folder, n)).learner["actor_state_dict"]
        for n in (1, 3)
    )
    assert not torch.equal(first["mlp.A"], last["mlp.A"])
    lines = (options.folder / "log.jsonl").read_text().splitlines()
    assert len(lines) == 3


def test_a_finished_run_trains_no_more(options):
    log = train(options, silent)
    assert train(options, killed_after(-1)) == log


def test_figures_that_nothing_was_counted_for_are_null_in_the_log(options):
    train(options, silent)  # episodes of three steps, in which no speed has settled
    last = (options.folder / "log.jsonl").read_text().splitlines()[-1]
    assert json.loads(last, parse_constant=pytest.fail)["vx_error_m_s"] is None


def test_more_processes_than_robots_are_refused(options):
    with pytest.raises(UsageError) as error:
        train(replace(options, workers=9), silent)
    assert str(error.value) == (
        "--threads 9: each of these processes needs one of the 8 robots; cure: --threads 8 or less"
    )
    assert not options.folder.exists()


def test_evaluations_use_the_processors_of_the_run(options, monkeypatch):
    asked = []

    def evaluate_in(*_arguments, threads, **_options):
        asked.append(threads)
        return evaluate.Evaluation(2, 0, 0.1, 0.1, 0.0, 0.0, 0.0)

    monkeypatch.setattr(train_module, "evaluate", evaluate_in)
    monkeypatch.setattr(train_module, "others", lambda *_: contextlib.nullcontext())
    monkeypatch.setattr(train_module, "_learn", lambda *_: {})
    train(replace(options, workers=3), silent)
    assert asked == [3]


@pytest.mark.slow
def test_a_run_that_ended_before_it_wrote_its_log_writes_it(options):
    train(options, silent)
    log = options.folder / "log.jsonl"
    whole = log.read_text()
    log.write_text(whole.splitlines(keepends=True)[0])
    train(options, silent)
    assert log.read_text() == whole


def test_a_run_with_another_seed_is_not_continued(options):
    train(replace(options, steps=32), silent)
    with pytest.raises(UsageError) as error:
        train(replace(options, seed=4), silent)
    assert str(error.value) == (
        f"'{options.folder}' holds a run with seed 3, not 4; "
        "choose another --out, or the same seed to go on"
    )


def test_a_run_with_hidden_noise_is_not_continued_without_it(options):
    train(replace(options, steps=32), silent)
    with pytest.raises(UsageError, match="holds a run with hidden_noise True, not False"):
        train(replace(options, stages=without_hidden_noise(options.stages)), silent)


def test_a_run_of_other_stages_is_not_continued(options):
    train(replace(options, steps=32), silent)
    others = (options.stages[0], replace(options.stages[1], first_step=32))
    with pytest.raises(UsageError, match=r"holds a run with stages \w{12}, not \w{12};"):
        train(replace(options, stages=others), silent)


def test_a_run_of_another_number_of_processes_is_not_continued(options):
    """Each process draws numbers of its own, so that another number of them is another run."""
    train(replace(options, steps=32), silent)
    with pytest.raises(UsageError, match="holds a run with threads 1, not 2;"):
        train(replace(options, workers=2), silent)


@pytest.mark.slow
def test_a_longer_run_is_not_cut_short(options):
    """A shorter run could not have chosen the policy of this one."""
    train(options, silent)
    with pytest.raises(UsageError) as error:
        train(replace(options, steps=64), silent)
    assert str(error.value) == (
        f"'{options.folder}' holds 3 segments, --steps asks for 2; "
        "cure: --steps 96 or more, or another --out"
    )


def test_a_broken_checkpoint_is_refused(options):
    path = checkpoint.path_of(options.folder, 1)
    path.parent.mkdir(parents=True)
    path.write_bytes(b"not a checkpoint")
    with pytest.raises(UsageError) as error:
        train(options, silent)
    assert str(error.value) == (
        f"'{path}' is not a checkpoint of this version (expected a whole zip archive, found one "
        "without a list of members); "
        "delete it to go on from the one before, or choose another --out"
    )


@pytest.mark.slow
def test_the_policy_is_evaluated_when_it_is_due_and_at_the_end(options):
    log = train(replace(options, steps=128, evaluate_every=3), silent)
    assert [entry.get("episodes") for entry in log] == [None, None, 2, 2]


def test_evaluations_are_rarer_before_the_last_stage(options):
    first, last = options.stages
    later = replace(last, first_step=9 * options.steps_per_segment)
    run = replace(options, steps=13 * options.steps_per_segment, evaluate_every=2)
    run = replace(run, stages=(first, later))
    evaluated = [segment + 1 for segment in range(run.segments) if run.evaluates(segment)]
    assert evaluated == [8, 10, 12, 13]
    # The last stage of a shorter run is the one in which it ends.
    short = replace(run, steps=7 * options.steps_per_segment)
    assert [n for n in range(short.segments) if short.evaluates(n)] == [1, 3, 5, 6]


def test_a_checkpoint_without_the_learners_networks_is_refused(options):
    state = checkpoint.Checkpoint(options.identity(), 1, {}, [])
    checkpoint.save(options.folder, state)
    with pytest.raises(UsageError, match=r"00001\.pt' is not a checkpoint of this version"):
        train(options, silent)


def test_a_checkpoint_of_other_code_is_refused(options):
    held = options.identity()
    now = held.pop("spikeport")
    # A checkpoint of an earlier version names no spikeport.
    for begun, named in (
        (held, "no spikeport"),
        ({**held, "spikeport": "0.1.0"}, "spikeport 0.1.0"),
    ):
        checkpoint.save(options.folder, checkpoint.Checkpoint(begun, 1, {}, []))
        with pytest.raises(UsageError) as caught:
            train(options, silent)
        assert f"holds a run with {named}, not {now}; " in str(caught.value)
