import pytest

from spikeport.experiments.switch.schedule import SHIPPED, load

WALK, DRAW = "walk = 0.8, draw = 0.4", "walk = 0.4, draw = 0.8"


@pytest.fixture
def file(tmp_path):
    return tmp_path / "schedule.toml"


@pytest.fixture
def text(phases):
    """Return a schedule that walks for six seconds and then draws for six."""
    return phases((6, 'path = "line"'), (6, 'arm = "digit"'))


@pytest.fixture
def refused(file, tmp_path, spikeport):
    """Return a function that gives the error of a text as a schedule; no run begins."""

    def run(text, *options, schedule=file):
        file.write_text(text)
        out, asked = tmp_path / "run", ("--set", f"schedule={schedule}", *options)
        code, printed, error = spikeport("run", "switch", *asked, "--out", out)
        assert (code, printed, out.exists()) == (2, "", False)
        return error.removeprefix("error: ").removesuffix("\n")

    return run


@pytest.fixture
def reason(refused, file, text):
    """Return a function that gives the reason why a changed schedule is refused."""

    def run(changed, to):
        assert changed in text
        where, what = refused(text.replace(changed, to)).split("\n  phases")
        assert where == f"{file}: not a schedule:"
        return what

    return run


# shipped schedules, and entries that may be left out


def test_the_shipped_schedule_has_the_four_phases_of_the_paper():
    schedule = load(SHIPPED["switch"], 26.0)
    assert [phase.name for phase in schedule.phases] == ["walk", "draw", "retract", "walk on"]
    assert [phase.action for phase in schedule.phases] == ["walk", "draw", "draw", "walk"]
    assert [phase.seconds for phase in schedule.phases] == [6, 12, 2, 6]
    assert schedule.end_s == 26


def test_the_free_standing_schedule_draws_for_half_a_minute():
    phases = load(SHIPPED["free-standing"], 60.0).phases
    assert sum(phase.seconds for phase in phases if phase.arm == "digit") == 30


def test_an_action_without_a_utility_has_utility_zero(file, text):
    file.write_text(text.replace("{ walk = 0.4, draw", "{ draw"))
    _, draw = load(file, 60.0).phases
    assert draw.values == (0.0, 0.8)
    assert (draw.action, draw.path, draw.arm) == ("draw", None, "digit")


def test_the_shortest_phase_is_not_too_short_by_rounding(file, phases):
    file.write_text(phases((0.2, 'path = "line"'), (0.5, 'arm = "reach"')))
    assert load(file, 60.0).phases[1].seconds == pytest.approx(0.5)


# refusals


@pytest.mark.parametrize(
    ("changed", "to", "message"),
    [
        ("begin_s = 6", "begin_s = 5", "'phase 1' begins at 5 s and overlaps 'phase 0', which {}"),
        (
            "begin_s = 6",
            "begin_s = 7",
            "'phase 1' begins at 7 s and leaves a gap after 'phase 0', which {}",
        ),
        ("begin_s = 0", "begin_s = 1", "'phase 0' begins at 1 s, not at 0 s"),
    ],
)
def test_phases_that_do_not_follow_each_other_are_refused(reason, changed, to, message):
    assert reason(changed, to) == ": " + message.format("ends at 6 s")


@pytest.mark.parametrize(
    ("changed", "to", "message"),
    [
        ("draw = 0.8", "jump = 0.8", "utilities: unknown action 'jump'; choose from: draw, walk"),
        ("draw = 0.8", "draw = 1.2", "utilities: 'draw' has utility 1.2, limit 0 to 1"),
        ("draw = 0.8", "draw = -0.2", "utilities: 'draw' has utility -0.2, limit 0 to 1"),
        ("draw = 0.8", "draw = nan", "utilities.draw: Input should be a finite number"),
        ("draw = 0.8", "draw = true", "utilities.draw: Input should be a valid number"),
        (
            "draw = 0.8",
            "draw = 0.4",
            "utilities: no single action has the highest utility; raise one above the others",
        ),
        (
            DRAW,
            "draw = 0.0",
            "utilities: no single action has the highest utility; raise one above the others",
        ),
        (
            DRAW,
            "draw = 0.1",
            "utilities: the highest utility is 0.1, and the basal ganglia then select both actions "
            "or none; raise it to 0.2 or more",
        ),
        (DRAW, "", "utilities: no action has a utility; give one to the action of this phase"),
        ("end_s = 12", "end_s = -1", "end_s: Input should be greater than or equal to 0"),
        ("end_s = 12", 'end_s = "12"', "end_s: Input should be a valid number"),
        (
            "end_s = 12",
            "end_s = 12.0004",
            "end_s: 12.0004 must be a whole number of steps of 0.001 s; cure: 12.0",
        ),
        ('name = "phase 1"\n', "", "name: is missing"),
        ('"phase 1"', '"\\u001b[2J"', r"name: holds control characters: '\x1b[2J'"),
        (
            'arm = "digit"',
            'arm = "digit"\npath = "a\\u0000b.csv"',
            r"path: holds control characters: 'a\x00b.csv'",
        ),
        ('arm = "digit"', 'arm = "digit"\nhaste = 1', "haste: is not a known key"),
        ('"digit"', '"wave"', "arm: Input should be 'digit', 'retract' or 'reach'"),
    ],
)
def test_invalid_values_of_a_phase_are_refused(reason, changed, to, message):
    assert reason(changed, to) == f".1.{message}"


@pytest.mark.parametrize(
    ("changed", "to", "message"),
    [
        ("end_s = 12", "end_s = 5", "1: end_s 5 is not after begin_s 6"),
        ("end_s = 12", "end_s = 9", '1: lasts 3 s, arm = "digit" takes at least 4 s'),
        ("end_s = 6", "end_s = 0.05", "0: lasts 0.05 s, a phase takes at least 0.1 s"),
        ('arm = "digit"\n', "", "1: selects 'draw', and needs 'arm'"),
        (WALK, DRAW, "0: selects 'draw', and needs 'arm'"),
        ('"digit"', '"digit"\nspeed_m_s = 1', "1: selects 'draw', and has no use for 'speed_m_s'"),
        (
            '"line"',
            '"own.csv"\nspeed_m_s = 0.9',
            "0: speed_m_s 0.9: 'own.csv' has times of its own; cure: leave it out, or change the "
            "times",
        ),
    ],
)
def test_inconsistent_phases_are_refused(reason, changed, to, message):
    assert reason(changed, to) == f".{message}"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not a schedule:\n  phases: is missing"),
        ("phases = [", "not TOML: Invalid value (at end of document)"),
        (
            "phases = []",
            "not a schedule:\n"
            "  phases: no phase selects 'draw'; the arm's controller is built for the tasks of "
            "such phases, so add one",
        ),
        ("haste = 1\nphases = 2", "not a schedule:\n  phases: Input should be a valid tuple\n  {}"),
    ],
)
def test_files_that_are_not_a_schedule_are_refused(refused, file, text, message):
    assert refused(text) == f"{file}: {message.format('haste: is not a known key')}"


def test_a_schedule_without_a_phase_for_the_arm_is_refused(refused, file, phases):
    assert refused(phases((6, 'path = "line"'))) == (
        f"{file}: not a schedule:\n"
        "  phases: no phase selects 'draw'; the arm's controller is built for the tasks of such "
        "phases, so add one"
    )


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("round", "unknown path 'round'; choose from: FILE.csv, figure-eight, line, loop, s-curve"),
        ("nothing.csv", "nothing.csv: no such file"),
    ],
)
def test_an_unknown_or_absent_path_is_refused(refused, file, text, path, message):
    assert refused(text.replace('"line"', f'"{path}"')) == f"{file}: phase 'phase 0': {message}"


def test_a_phase_that_ends_after_the_run_is_refused(refused, file, text):
    assert refused(text, "--seconds", "10") == (
        f"{file}: phase 'phase 1' ends at 12 s, the run at 10 s; "
        "cure: --seconds 12, or shorter phases"
    )


def test_an_unknown_or_absent_schedule_is_refused(refused, tmp_path):
    known = "choose from: free-standing, switch, the path of a file"
    assert refused("", schedule="none") == f"unknown schedule 'none'; {known}"
    assert refused("", schedule="none.toml") == (
        "schedule=none.toml: no such file; cure: one of free-standing, switch, or the path of a "
        "file"
    )
    assert refused("", schedule=tmp_path) == f"{tmp_path}: cannot be read: Is a directory"
