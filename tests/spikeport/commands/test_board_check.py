"""`board check`: its lines on each placement of an image, and its exit code."""

from pathlib import Path

import pytest

from spikeport.commands.board_check import run
from spikeport.compile.image.chip_image import ChipImage
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.two_blocks import two_blocks
from tests.helpers.writable import writable


def checked(
    image: ChipImage, folder: Path, capsys: pytest.CaptureFixture[str]
) -> tuple[int, list[str]]:
    """Return the exit code and the lines of a check of 9 steps."""
    image.save(folder / "image.npz")
    code = run(folder / "image.npz", n_steps=9, seed=0)
    return code, capsys.readouterr().out.splitlines()


def test_both_placements_are_checked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    image = writable(two_blocks())
    image = image.on_cores(0 * image.blocks.core)
    code, lines = checked(image, tmp_path, capsys)
    nothing = (
        "  9 steps, 0 spikes; differing: u 0, v 0, spikes 0, settings of noise 0, "
        "registers of learning 0"
    )
    unread = "  0 phantom spikes in 0 values that snips read"
    assert code == 0
    assert lines == [
        f"image {image.digest[:12]}: 5 compartments in 2 blocks, 4 synapses, 1 source on the host",
        "one block a core: 2 cores, 4 synapses, 38 registers written",
        nothing,
        unread,
        "packed: 1 core, 4 synapses, 27 registers written",
        nothing,
        unread,
        "  NX10 not provable offline: index bits: blocks that share a core: 2 of 2 weight rows, "
        "moved by the blocks before theirs; cure: one block a core: compile with -p unpacked, or "
        "compact_unpacked; then run it on a board",
    ]


def test_an_image_that_differs_exits_with_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, lines = checked(Parts([Block(1, bias=37, vth=100)]).image(), tmp_path, capsys)
    assert code == 1
    assert len(lines) == 4  # one placement: there is one block
    assert "spikes 0," not in lines[2]


def test_a_refused_packed_placement_is_not_a_failure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    parts = Parts([Block(1), Block(1)], [Group([[64]], pop_type=32)], routes=[Route([0], block=1)])
    code, lines = checked(writable(parts.image()), tmp_path, capsys)
    assert code == 0
    refused = "packed: not written, nengo-loihi's hardware half refuses it"
    assert refused in lines
    assert lines[lines.index(refused) + 1].startswith("  NX04 refused: population axons")


def test_an_image_that_cannot_be_written_at_all_exits_with_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    parts = Parts([Block(300)], [Group([[64]], axon_base=[257])])
    code, lines = checked(writable(parts.image()), tmp_path, capsys)
    assert code == 1
    assert lines[1].startswith("one block a core: not written")
