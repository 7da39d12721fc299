"""Images by file, and by the folder of a compile."""

from pathlib import Path

import pytest

from spikeport.commands import image_file as module
from spikeport.commands.image_file import image_file


def test_an_image_is_found_in_its_folder(tmp_path: Path) -> None:
    (tmp_path / "image.npz").touch()
    assert image_file(tmp_path) == image_file(tmp_path / "image.npz") == tmp_path / "image.npz"


def test_these_are_the_commands_that_read_an_image() -> None:
    folder = Path(module.__file__).parent
    readers = {p.stem for p in folder.glob("*.py") if "ChipImage.load(" in p.read_text()}
    # `board` only checks the file of --keep.
    assert readers == {"show", "step", "export", "board", "board_check", "board_write"}


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
