import imageio_ffmpeg
import numpy as np
import pytest

from spikeport.errors import MissingExtraError, UsageError
from spikeport.robot import video
from spikeport.robot.video import VideoWriter
from tests.helpers.full_disk import largest_file


def frame(level):
    return np.full((36, 66, 3), level, dtype=np.uint8)


def test_frames_come_back_in_order(tmp_path):
    path = tmp_path / "a.mp4"
    with VideoWriter(path, fps=20) as writer:
        for level in (0, 120, 240):
            writer.add(frame(level))
        assert not path.exists()
    reader = imageio_ffmpeg.read_frames(path)
    about = next(reader)
    assert (about["fps"], about["size"], about["codec"]) == (20, (66, 36), "h264")
    frames = [np.frombuffer(f, dtype=np.uint8) for f in reader]
    assert [f.size for f in frames] == [36 * 66 * 3] * 3
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


def write_noise(path, n_frames):
    rng = np.random.default_rng(0)
    with VideoWriter(path, fps=20) as writer:
        for _ in range(n_frames):
            writer.add(rng.integers(256, size=(240, 320, 3), dtype=np.uint8))


# The encoder notices a full disk as it ends, or as it still takes pictures.
@pytest.mark.parametrize("n_frames", [12, 100])
def test_a_video_that_cannot_be_written_whole_leaves_the_older_file_alone(tmp_path, n_frames):
    path = tmp_path / "a.mp4"
    path.write_bytes(b"older")
    with largest_file(65536), pytest.raises(OSError, match="no video: the encoder") as error:
        write_noise(path, n_frames)
    assert error.value.filename == str(path)
    assert path.read_bytes() == b"older"
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


def test_a_folder_with_a_colon_is_no_protocol(tmp_path):
    path = tmp_path / "a:b" / "a.mp4"
    write_noise(path, 1)
    assert path.stat().st_size > 0


def test_an_odd_size_is_refused(tmp_path):
    with VideoWriter(tmp_path / "a.mp4", fps=20) as writer, pytest.raises(UsageError) as error:
        writer.add(np.zeros((35, 64, 3), np.uint8))
    assert str(error.value) == "a video of 64 x 35 pixels; H.264 needs even numbers"
    assert list(tmp_path.iterdir()) == []


def test_absent_packages_name_the_extra(tmp_path, monkeypatch):
    monkeypatch.setattr(video, "find_spec", lambda _name: None)
    with pytest.raises(MissingExtraError) as error:
        VideoWriter(tmp_path / "a.mp4", fps=20)
    assert str(error.value) == (
        "a video needs the package imageio-ffmpeg, which is absent; "
        "install it with: pip install 'spikeport[video]'"
    )


def test_a_machine_without_the_encoder_s_program_is_named_with_a_cure(tmp_path, monkeypatch):
    def absent():
        raise RuntimeError("No ffmpeg exe could be found")

    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", absent)
    with (
        pytest.raises(MissingExtraError, match="a video needs the package ffmpeg, which is absent"),
        VideoWriter(tmp_path / "a.mp4", fps=20) as writer,
    ):
        writer.add(frame(0))
