import re

import pytest

from spikeport.errors import ChipFileError, UsageError
from spikeport.hardware_models import chip as chips

LOIHI = (chips.BUILT_IN / "loihi.toml").read_text(encoding="utf-8")


def edited(tmp_path, *edits):
    """Return a copy of Loihi's file with text replaced once for every edit."""
    text = LOIHI
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / "edited.toml"
    path.write_text(text, encoding="utf-8")
    return path


def assert_refused(path, message):
    with pytest.raises(ChipFileError) as caught:
        chips.load(path)
    assert str(caught.value) == message


CORES = '[limits.cores]\nvalue = 128\nunit = "1"\nsource = "Davies 2018"\n'


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        (CORES, CORES.replace('unit = "1"\n', ""), "limits.cores.unit: is missing"),
        (CORES, CORES.replace('source = "Davies 2018"\n', ""), "limits.cores.source: is missing"),
        (
            CORES,
            CORES.replace("128", "-128"),
            "limits.cores.value: Input should be greater than or equal to 0",
        ),
        (
            CORES,
            CORES.replace("128", "0"),
            "limits.cores: must be a whole number from 1 to 2^53, not 0",
        ),
        (
            CORES,
            CORES.replace("128", "1.5"),
            "limits.cores: must be a whole number from 1 to 2^53, not 1.5",
        ),
        (
            CORES,
            CORES.replace("128", '"128"'),
            "limits.cores.value: Input should be a valid number",
        ),
        (CORES, CORES.replace("128", "nan"), "limits.cores.value: Input should be a finite number"),
        (CORES, CORES.replace('"1"', '"bit"'), "limits.cores: unit 'bit' does not convert to '1'"),
        (CORES, CORES + "size = 3\n", "limits.cores.size: is not a known key"),
        (
            CORES,
            CORES.replace("128", "129"),
            "topology: has places for 128 cores, but limits.cores is 129",
        ),
        ("[limits.cores]", "[limits.kernels]", None),
        (
            'value = 0.94\nunit = "W"',
            'value = 0.94\nunit = "watt"',
            "power.board_idle_w.unit: unknown unit 'watt'; "
            "choose from: 1, J, W, bit, mW, ms, nJ, ns, pJ, s, uW, us",
        ),
        ('value = 0.94\nunit = "W"', 'value = 940\nunit = "mW"\nlow = 950', None),
        ("schema = 1", "schema = 2", "schema: version 2 is not supported, only 1"),
        (
            "spike = { value = 69.3, low = 60.984",
            "spike = { value = 69.3, low = 70",
            "calibrations.1.energies.spike: low 70 is above value 69.3",
        ),
        (
            "spike = { value = 30, low = 22.5, high = 37.5",
            "spike = { value = 30, low = 22.5, high = 29",
            "calibrations.1.times.spike: high 29 is below value 30",
        ),
        (
            "tiles = 4\n",
            "tiles = 2\n",
            "calibrations.1.barrier: tiles must increase from point to point, not [1, 2, 2, 29]",
        ),
        (
            'name = "nahuku-fit"',
            'name = "davies2018"',
            "calibrations: two have the same name: davies2018, davies2018",
        ),
        (
            'title = "Intel Loihi"',
            'title = "\\u001b[2JLoihi"',
            r"title: holds control characters: '\x1b[2JLoihi'",
        ),
        (
            'evidence = "abstract"',
            'evidence = "hearsay"',
            "power.board_idle_w.evidence: "
            "Input should be 'code', 'transcribed', 'abstract', 'vendor', 'thread' or 'tool'",
        ),
    ],
)
def test_a_problem_of_a_chip_file_is_named(tmp_path, old, new, problem):
    path = edited(tmp_path, (old, new))
    several = {
        "[limits.kernels]": "limits.cores: is missing\n  limits.kernels: is not a known key",
        'value = 940\nunit = "mW"\nlow = 950': "power.board_idle_w: low 950 is above value 940",
    }
    assert_refused(path, f"{path}: not a chip:\n  {problem or several[new]}")


def test_all_problems_are_reported_at_once(tmp_path):
    path = edited(
        tmp_path,
        ("schema = 1", "schema = 9"),
        (CORES, CORES.replace("128", "-1")),
        ("[topology.tiles_x]", "[topology.tiles_z]"),
    )
    assert_refused(
        path,
        f"{path}: not a chip:\n"
        "  schema: version 9 is not supported, only 1\n"
        "  limits.cores.value: Input should be greater than or equal to 0\n"
        "  topology.tiles_x: is missing\n"
        "  topology.tiles_z: is not a known key",
    )


def test_a_missing_file_is_refused(tmp_path):
    path = tmp_path / "none.toml"
    assert_refused(path, f"{path}: no such file")


def test_a_folder_is_refused(tmp_path):
    assert_refused(tmp_path, f"{tmp_path}: cannot be read: Is a directory")


def test_a_file_that_is_not_toml_is_refused(tmp_path):
    path = tmp_path / "chip.toml"
    path.write_text("schema: 1\n", encoding="utf-8")
    with pytest.raises(ChipFileError, match=rf"^{re.escape(str(path))}: not TOML: .*line 1"):
        chips.load(path)


def test_a_file_that_is_not_text_is_refused(tmp_path):
    path = tmp_path / "chip.toml"
    path.write_bytes(b"\xff")
    with pytest.raises(ChipFileError, match=rf"^{re.escape(str(path))}: not TOML: "):
        chips.load(path)


def test_every_built_in_chip_is_found_by_its_name():
    assert "loihi" in chips.names()
    assert all(chips.get(name).name == name for name in chips.names())


def test_get_takes_a_path(tmp_path):
    path = edited(tmp_path, ('name = "loihi"', 'name = "mine"'))
    assert chips.get(str(path)).name == "mine"


def test_an_unknown_chip_is_refused_with_the_known_names():
    with pytest.raises(UsageError) as caught:
        chips.get("lohi")
    assert str(caught.value) == f"unknown chip 'lohi'; choose from: {', '.join(chips.names())}"


def test_a_chip_file_with_another_ending_is_refused_with_the_right_one():
    with pytest.raises(UsageError, match=r"; the file of a chip ends in \.toml$"):
        chips.get("my.yaml")


def test_an_unknown_calibration_is_refused_with_the_known_names():
    with pytest.raises(UsageError) as caught:
        chips.get("loihi").calibration("spice")
    assert str(caught.value) == "unknown calibration 'spice'; choose from: davies2018, nahuku-fit"


def test_a_chip_cannot_be_changed():
    with pytest.raises(ValueError, match="frozen"):
        chips.get("loihi").limits.cores.value = 256
