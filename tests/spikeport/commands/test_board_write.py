"""`board write`: the files with which an FPGA runs an image."""

import dataclasses
from pathlib import Path

import pytest

from spikeport.backends.softcore import port
from spikeport.backends.softcore.writer import written
from spikeport.commands.board_write import run
from spikeport.errors import BackendError, UsageError
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.chip import BUILT_IN
from tests.helpers.fake_board import small_image
from tests.helpers.images import Block, Group, Output, Parts, Route

CHIP = "softcore-ecp5-85f"


def test_board_write_writes_parameters_for_verilog_and_bytes_to_load(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    small_image().save(tmp_path / "image.npz")
    run(tmp_path / "image.npz", tmp_path / "out", chip=CHIP)
    parameters = (tmp_path / "out" / "parameters.vh").read_text()
    assert "`define LOG_QUEUE 9\n" in parameters
    assert "`define WORDS {20'd1024, 20'd1024}\n" in parameters
    loading = (tmp_path / "out" / "load.bin").read_bytes()
    assert port.loading(written(small_image()), [])[:-10] in loading
    printed = capsys.readouterr().out
    assert f"memory image {written(small_image()).digest[:16]} of image" in printed
    assert f"load.bin: {len(loading)} bytes" in printed


@pytest.mark.parametrize(
    ("parts", "chip", "reason"),
    [
        (Parts(blocks=[Block(enable_noise=1)]), CHIP, "1 compartments have noise"),
        (Parts(blocks=[Block(n=513)]), "softcore-up5k", "SP103 compartments: 513, limit 512"),
        (Parts(blocks=[Block(), Block(core=1)]), "softcore-up5k", "SP201 cores: 2, limit 1"),
        (
            Parts(blocks=[Block(n=256)], outputs=[Output("spiked", range(256))]),
            "softcore-up5k",
            "outputs: 256, limit 255; cure: probe fewer neurons",
        ),
        (
            # A weight of 20 bits takes three rows of 8, and each of them an output axon.
            Parts(
                blocks=[Block(n=400)],
                groups=[Group([[2**19 + 2**9 + 1]])],
                routes=[Route([0] * 400, block=0)],
            ),
            "softcore-up5k",
            "SP101 out-axons: 1,200, limit 512",
        ),
    ],
)
def test_an_image_that_a_chip_cannot_hold_is_refused(
    parts: Parts, chip: str, reason: str, tmp_path: Path
) -> None:
    parts.image().save(tmp_path / "image.npz")
    with pytest.raises(BackendError, match=reason):
        run(tmp_path / "image.npz", tmp_path / "out", chip=chip)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("own", "chip", "expected"),
    [
        ("softcore-up5k", None, "softcore-up5k"),
        ("softcore-up5k", CHIP, CHIP),
        ("loihi", None, CHIP),
        ("a-users.toml", None, CHIP),
    ],
)
def test_the_default_chip_is_the_images_own_if_it_has_soft_cores(
    own: str, chip: str | None, expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    image = Parts().image()
    manifest = dataclasses.replace(image.manifest, chip=own)
    dataclasses.replace(image, manifest=manifest).save(tmp_path / "image.npz")
    run(tmp_path / "image.npz", tmp_path / "out", chip=chip)
    assert f"chip {expected}\n" in capsys.readouterr().out


def test_a_file_in_place_of_the_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").touch()
    with pytest.raises(UsageError, match="is a file; choose a folder"):
        run(tmp_path / "image.npz", tmp_path / "out", chip=CHIP)


def test_a_chip_model_of_several_fpgas_is_refused(tmp_path: Path) -> None:
    small_image().save(tmp_path / "image.npz")
    text = (BUILT_IN / "softcore-up5k.toml").read_text(encoding="utf-8")
    chip = tmp_path / "two.toml"
    chip.write_text(text.replace("[limits.chips]\nvalue = 1", "[limits.chips]\nvalue = 2"))
    with pytest.raises(UsageError, match=r"limits.chips is 2, but .* of one FPGA, limit 1; write"):
        run(tmp_path / "image.npz", tmp_path / "out", chip=str(chip))
    assert not (tmp_path / "out").exists()


def test_a_chip_without_soft_cores_is_refused(tmp_path: Path) -> None:
    small_image().save(tmp_path / "image.npz")
    soft = [name for name in chips.names() if chips.get(name).soft_memory]
    with pytest.raises(UsageError, match=f"chip 'loihi' has no soft cores; .*: {', '.join(soft)}"):
        run(tmp_path / "image.npz", tmp_path / "out", chip="loihi")
