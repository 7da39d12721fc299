import imageio.v2 as imageio
import numpy as np
import pytest

from spikeport.errors import MissingExtraError, UsageError
from spikeport.robot import video
from spikeport.robot.video import VideoWriter


def frame(level):
    return np.full((36, 66, 3), level, dtype=np.uint8)


def test_frames_come_back_in_order(tmp_path):
    path = tmp_path / "a.mp4"
    with VideoWriter(path, fps=20) as writer:
        for level in (0, 120, 240):
            writer.add(frame(level))
        assert not path.exists()
    with imageio.get_reader(path) as reader:
        assert reader.get_meta_data()["fps"] == 20
        frames = [np.asarray(f) for f in reader]
    assert [f.shape for f in frames] == [(36, 66, 3)] * 3
    np.testing.assert_allclose([f.mean() for f in frames], [0, 120, 240], atol=6)
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


def write_and_fail(path):
    with VideoWriter(path, fps=20) as writer:
        writer.add(frame(0))
        raise KeyError("broken run")


def test_an_error_leaves_the_older_file_alone(tmp_path):
    path = tmp_path / "a.mp4"
    path.write_bytes(b"older")
    with pytest.raises(KeyError, match="broken run"):
        write_and_fail(path)
    assert path.read_bytes() == b"older"
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


def test_an_odd_size_is_refused(tmp_path):
    with VideoWriter(tmp_path / "a.mp4", fps=20) as writer, pytest.raises(UsageError) as error:
        writer.add(np.zeros((35, 64, 3), np.uint8))
    assert str(error.value) == "a video of 64 x 35 pixels; H.264 needs even numbers"
    assert list(tmp_path.iterdir()) == []


def test_absent_packages_name_the_extra(tmp_path, monkeypatch):
    monkeypatch.setattr(video, "find_spec", lambda name: None if "ffmpeg" in name else object())
    with pytest.raises(MissingExtraError) as error:
        VideoWriter(tmp_path / "a.mp4", fps=20)
    assert str(error.value) == (
        "a video needs the package imageio-ffmpeg, which is absent; "
        "install it with: pip install 'spikeport[video]'"
    )
