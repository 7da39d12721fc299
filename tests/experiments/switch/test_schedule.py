import pytest

from spikeport.errors import UsageError
from spikeport.experiments.switch.schedule import SHIPPED, load


@pytest.fixture
def text(phases):
    """A walk of six seconds, and six of drawing."""
    return phases((6, 'path = "line"'), (6, 'arm = "digit"'))


def read(tmp_path, text, seconds=60.0):
    path = tmp_path / "schedule.toml"
    path.write_text(text)
    return load(path, seconds)


def test_the_shipped_one_has_the_four_phases_of_the_paper():
    schedule = load(SHIPPED, 26.0)
    assert [phase.name for phase in schedule.phases] == ["walk", "draw", "retract", "walk on"]
    assert [phase.action for phase in schedule.phases] == ["walk", "draw", "draw", "walk"]
    assert [phase.seconds for phase in schedule.phases] == [6, 12, 2, 6]
    assert schedule.end_s == 26


def test_an_action_without_utility_has_none(tmp_path, text):
    _, draw = read(tmp_path, text.replace("{ walk = 0.4, draw", "{ draw")).phases
    assert draw.values == (0.0, 0.8)
    assert (draw.action, draw.path, draw.arm) == ("draw", None, "digit")


@pytest.mark.parametrize(
    ("changed", "to", "message"),
    [
        (
            "begin_s = 6",
            "begin_s = 5",
            "phases: 'phase 1' begins at 5 s and overlaps 'phase 0', which ends at 6 s",
        ),
        (
            "begin_s = 6",
            "begin_s = 7",
            "phases: 'phase 1' begins at 7 s and leaves a gap after 'phase 0', which ends at 6 s",
        ),
        ("begin_s = 0", "begin_s = 1", "phases: 'phase 0' begins at 1 s, not at 0 s"),
        (
            "draw = 0.8",
            "jump = 0.8",
            "phases.1.utilities: unknown action 'jump'; there is: draw, walk",
        ),
        (
            "draw = 0.8",
            "draw = 1.2",
            "phases.1.utilities: 'draw' has utility 1.2, limit 0 to 1",
        ),
        (
            "draw = 0.8",
            "draw = -0.2",
            "phases.1.utilities: 'draw' has utility -0.2, limit 0 to 1",
        ),
        (
            "walk = 0.4, draw = 0.8",
            "walk = 0.8, draw = 0.8",
            "phases.1.utilities: no action has the highest utility; give one more than the others",
        ),
        ("end_s = 12", "end_s = 5", "phases.1: end_s 5 is not after begin_s 6"),
        (
            "end_s = 12",
            "end_s = 9",
            'phases.1: lasts 3 s, arm = "digit" takes at least 4 s',
        ),
        (
            "begin_s = 6\nend_s = 12",
            "begin_s = 6\nend_s = 6.01",
            'phases.1: lasts 0.01 s, arm = "digit" takes at least 4 s',
        ),
        ("end_s = 6", "end_s = 0.05", "phases.0: lasts 0.05 s, it takes at least 0.1 s"),
        ('arm = "digit"\n', "", "phases.1: selects 'draw', and needs 'arm'"),
        (
            'path = "line"',
            'path = "line"\narm = "reach"',
            "phases.0: selects 'walk', and has no use for 'arm'",
        ),
        (
            'arm = "digit"',
            'arm = "digit"\nspeed_m_s = 0.5',
            "phases.1: selects 'draw', and has no use for 'speed_m_s'",
        ),
        ('name = "phase 1"\n', "", "phases.1.name: is missing"),
        ('path = "line"', 'path = "line"\nhaste = 1', "phases.0.haste: is not a known key"),
    ],
)
def test_what_is_wrong_is_told_with_path_and_reason(tmp_path, text, changed, to, message):
    assert changed in text
    with pytest.raises(UsageError) as caught:
        read(tmp_path, text.replace(changed, to))
    assert str(caught.value) == f"{tmp_path}/schedule.toml: not a schedule:\n  {message}"


def test_an_arm_without_work_is_refused(tmp_path, phases):
    with pytest.raises(UsageError) as caught:
        read(tmp_path, phases((6, 'path = "line"')))
    assert str(caught.value) == (
        f"{tmp_path}/schedule.toml: not a schedule:\n"
        "  phases: none selects 'draw': the arm's controller is made for what it does"
    )


def test_the_shortest_phase_is_not_too_short_by_rounding(tmp_path, phases):
    schedule = read(tmp_path, phases((0.2, 'path = "line"'), (0.5, 'arm = "reach"')))
    assert schedule.phases[1].seconds == pytest.approx(0.5)


def test_no_phases_are_no_schedule(tmp_path):
    with pytest.raises(UsageError) as caught:
        read(tmp_path, "phases = []")
    assert str(caught.value) == (
        f"{tmp_path}/schedule.toml: not a schedule:\n"
        "  phases: Tuple should have at least 1 item after validation, not 0"
    )


def test_a_phase_longer_than_the_run_is_refused(tmp_path, text):
    with pytest.raises(UsageError) as caught:
        read(tmp_path, text, seconds=10.0)
    assert str(caught.value) == (
        f"{tmp_path}/schedule.toml: phase 'phase 1' ends at 12 s, the run at 10 s; "
        "cure: --seconds 12, or shorter phases"
    )


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(UsageError) as caught:
        load(tmp_path / "nothing.toml", 10.0)
    assert str(caught.value) == f"{tmp_path}/nothing.toml: no such file"
