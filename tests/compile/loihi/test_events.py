"""Event files: read as nengo-loihi reads them, and refused where it would go wrong."""

from pathlib import Path
from typing import Any

import nengo_loihi
import numpy as np
import pytest

from spikeport.compile.loihi import events
from spikeport.compile.loihi.events import event_steps, own_event_reader, read_sources
from spikeport.errors import UsageError
from tests.helpers.event_files import HEADER, process_of, random_events, write_events

GOOD = random_events(200, last_us=50_000)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"pool": (5, 3)},
        {"pool": (2, 4), "channels_last": False},
        {"rel_time": False},
    ],
    ids=str,
)
def test_an_aedat_file_is_read_as_nengo_loihi_reads_it(
    options: dict[str, Any], tmp_path: Path
) -> None:
    process = process_of(write_events(tmp_path / "camera.aedat", **GOOD), **options)
    theirs_t, theirs = process._read_events()
    t_us, source = read_sources(process)
    assert np.all(np.diff(t_us) >= 0)
    pairs = sorted(zip(t_us.tolist(), source.tolist(), strict=True))
    assert pairs == sorted(zip(theirs_t.tolist(), theirs.tolist(), strict=True))
    assert t_us[0] == (GOOD["t"].min() if "rel_time" in options else 0)


def test_an_events_file_is_read_as_nengo_loihi_writes_it(tmp_path: Path) -> None:
    written = nengo_loihi.dvs.DVSEvents()
    rows = zip(*(GOOD[name] for name in "yxp"), [0] * 200, GOOD["t"], strict=True)
    written.init_events([tuple(int(value) for value in row) for row in rows])
    path = tmp_path / "camera.events"
    written.write_file(str(path))
    assert path.read_bytes() == write_events(tmp_path / "ours.events", **GOOD).read_bytes()
    t_us, source = read_sources(process_of(path))
    order = np.argsort(GOOD["t"], kind="stable")
    np.testing.assert_array_equal(t_us, GOOD["t"][order])
    expected = (GOOD["y"] * 16 + GOOD["x"]) * 2 + GOOD["p"]
    np.testing.assert_array_equal(source, expected[order])


def test_each_event_is_one_spike_in_its_step(tmp_path: Path) -> None:
    t = np.array([0, 999, 1000, 1000, 5999])
    path = write_events(tmp_path / "camera.events", t=t, y=t * 0, x=[0, 1, 2, 2, 3], p=t * 0)
    steps = event_steps(process_of(path), dt_s=0.001)
    assert [steps.at(n).tolist() for n in range(8)] == [[], [0, 2], [4, 4], [], [], [], [6], []]
    late = event_steps(process_of(path, t_start=0.001), dt_s=0.002)
    assert [late.at(n).tolist() for n in range(1, 4)] == [[4, 4], [], [6]]


def test_a_step_of_whole_microseconds_begins_exactly(tmp_path: Path) -> None:
    # 0.000246 * 1e6 is 246.00000000000003, which would put the event into the first step.
    path = write_events(tmp_path / "camera.events", t=[245, 246], y=[0, 0], x=[0, 0], p=[0, 0])
    assert event_steps(process_of(path), 0.000246).step.tolist() == [1, 2]


def test_a_file_without_events_gives_no_spikes(tmp_path: Path) -> None:
    for suffix in ("events", "aedat"):
        empty = {name: array[:0] for name, array in GOOD.items()}
        path = write_events(tmp_path / f"camera.{suffix}", **empty)
        assert event_steps(process_of(path), dt_s=0.001).at(1).tolist() == []


def test_float_nengo_uses_our_reader_only_within_the_context(tmp_path: Path) -> None:
    process = process_of(write_events(tmp_path / "camera.events", **GOOD))
    damaged = process_of(tmp_path / "damaged.events")
    Path(damaged.file_path).write_bytes(b"123456789")
    theirs = type(process)._read_events
    with own_event_reader():
        step = process.make_step((0,), (process.size,), 0.001, None, None)
        with pytest.raises(UsageError, match="expected events of 8 bytes"):
            damaged.make_step((0,), (damaged.size,), 0.001, None, None)
    assert type(process)._read_events is theirs
    image = step(0.02)
    found = event_steps(process, 0.001).at(20)
    assert image.sum() == pytest.approx(1000 * len(found))
    assert set(np.flatnonzero(image)) == set(found)


def refused(path: Path, content: bytes | None = None, **options: Any) -> str:
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(UsageError) as raised:
        read_sources(process_of(path, **options))
    assert raised.value.exit_code == 2
    assert str(raised.value).startswith(f"{path}: ")
    return str(raised.value).removeprefix(f"{path}: ").removeprefix("not a file of events: ")


def test_a_file_that_is_not_an_event_file_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, aedat = tmp_path / "camera.events", tmp_path / "camera.aedat"
    assert refused(path) == "no such file"
    assert refused(tmp_path) == "expected file_fmt or suffix aedat or events, found none"
    (tmp_path / "folder.events").mkdir()
    assert refused(tmp_path / "folder.events") == "cannot be read: Is a directory"
    assert (
        refused(path, b"123456789") == "expected events of 8 bytes, found 1 more bytes at the end"
    )
    version = "expected #!AER-DAT2.0, the only version that is read, found"
    assert refused(aedat, b"#!AER-DAT3.1\n") == f"{version} b'#!AER-DAT3.1'"
    assert refused(aedat, b"") == f"{version} b''"
    endless = HEADER + b"#" * 2**17
    found = "expected a header of at most 65,536 bytes, found a longer one"
    assert refused(aedat, endless) == found
    assert refused(path, b"12345678", file_fmt="txt").endswith("found txt")
    monkeypatch.setattr(events, "FILE_BYTES", 16)
    assert refused(path, b"1" * 24) == "expected a file of at most 16 bytes, found 24"


def test_pixels_that_the_camera_lacks_are_refused(tmp_path: Path) -> None:
    path = write_events(tmp_path / "camera.events", **GOOD)
    assert refused(path, dvs_width=10).startswith(
        "expected 12 rows and 10 columns (dvs_height, dvs_width), found an event in row"
    )
    assert read_sources(process_of(path, dvs_height=13))[0].shape == (200,)
