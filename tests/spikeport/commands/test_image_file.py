"""Images by file, and by the folder of a compile."""

from pathlib import Path

import pytest

from spikeport.commands.image_file import image_file


def test_an_image_is_found_in_its_folder(tmp_path: Path) -> None:
    (tmp_path / "image.npz").touch()
    assert image_file(tmp_path) == image_file(tmp_path / "image.npz") == tmp_path / "image.npz"


@pytest.mark.parametrize(
    "command",
    [
        ("show",),
        ("step", "--steps", "2", "--out", "OUT/out.npz"),
        ("export", "--nir", "OUT/out.nir"),
        ("board", "check", "--steps", "2"),
        ("board", "write", "--out", "OUT/soft"),
    ],
)
def test_every_command_that_reads_an_image_takes_the_folder_of_a_compile(
    spikeport, net_py, tmp_path, command
):
    folder = tmp_path / "compiled"
    assert spikeport("compile", f"{net_py}:make", "--out", folder).code == 0
    words = [word.replace("OUT", str(tmp_path)) for word in command]
    done = spikeport(*words, folder)
    assert (done.code, done.err) == (0, "")
    refused = spikeport(*words, tmp_path)
    assert refused.code == 2
    assert refused.err == (
        f"error: {tmp_path}: has no image.npz; give an image, or a folder of `compile --out`\n"
    )
