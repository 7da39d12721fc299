"""Images in files: equal when loaded again, and refused if altered, truncated or foreign."""

import errno
import json
import tracemalloc
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import SCHEMA
from spikeport.compile.image.tables import LAYOUT
from spikeport.compile.pipeline import Compilation
from spikeport.errors import ImageError
from spikeport.reading.text import MOST_PARTS

DAMAGED = "not a chip image, or truncated or altered"


@pytest.fixture(params=["chain", "convolution"])
def any_image(
    request: pytest.FixtureRequest,
    compiled_chain: Compilation,
    compiled_convolution: Compilation,
) -> ChipImage:
    return {"chain": compiled_chain, "convolution": compiled_convolution}[request.param].image


@pytest.fixture
def file(image: ChipImage, tmp_path: Path) -> Path:
    image.save(tmp_path / "arm.image")
    return tmp_path / "arm.image"


def rewrite(path: Path, change: Callable[[dict[str, np.ndarray]], None]) -> None:
    """Read a file as anyone with NumPy can, change it, and write it again."""
    with np.load(path) as stored:
        members: dict[str, Any] = dict(stored)
    change(members)
    with open(path, "wb") as stream:
        np.savez_compressed(stream, **members)


def pack(value: Any) -> np.ndarray:
    return np.frombuffer(json.dumps(value).encode(), np.uint8)


def refusal(path: Path) -> str:
    with pytest.raises(ImageError) as raised:
        ChipImage.load(path)
    message = str(raised.value)
    assert message.startswith(f"{path}: ")
    return message.removeprefix(f"{path}: ")


def test_an_image_survives_save_and_load(any_image: ChipImage, tmp_path: Path) -> None:
    any_image.save(tmp_path / "image")
    loaded = ChipImage.load(tmp_path / "image")
    assert loaded == any_image
    assert loaded.manifest == any_image.manifest
    for name, array in any_image.arrays.items():
        assert np.array_equal(loaded.arrays[name], array)
        assert loaded.arrays[name].dtype == array.dtype


def test_equal_images_give_equal_files(image: ChipImage, tmp_path: Path) -> None:
    image.save(tmp_path / "one")
    ChipImage.from_arrays(image.manifest, image.arrays).save(tmp_path / "two")
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


def test_the_layout_lists_exactly_the_arrays_of_a_file(image: ChipImage, file: Path) -> None:
    with np.load(file) as stored:
        assert {*stored.files} == {"header", *LAYOUT}
        assert {name: stored[name].dtype.str for name in LAYOUT} == {
            name: column.dtype for name, column in LAYOUT.items()
        }
    assert set(image.arrays) == set(LAYOUT)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    assert refusal(tmp_path / "none") == "no such file"


def test_a_folder_is_refused(tmp_path: Path) -> None:
    assert refusal(tmp_path) == "cannot be read: Is a directory"


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_a_truncated_file_is_refused(share: float, file: Path) -> None:
    content = file.read_bytes()
    file.write_bytes(content[: int(share * len(content))])
    assert refusal(file) == DAMAGED


def test_a_file_with_a_damaged_byte_is_refused_or_loads_equal(image: ChipImage, file: Path) -> None:
    content = file.read_bytes()
    rng = np.random.RandomState(0)
    refused = 0
    for position in rng.randint(len(content), size=150):
        damaged = bytearray(content)
        damaged[position] ^= 0xFF
        file.write_bytes(damaged)
        try:
            # Some bytes of a zip file, its times for instance, carry nothing.
            assert ChipImage.load(file) == image
        except ImageError:
            refused += 1
    assert refused > 75  # more than half


@pytest.mark.slow
def test_a_file_that_inflates_too_much_is_refused(file: Path) -> None:
    """The file of 130 kB holds an array of 128 MB of zeros."""

    def change(members: dict[str, np.ndarray]) -> None:
        members["weights"] = np.zeros(32 << 20, dtype=np.int32)

    rewrite(file, change)
    size = file.stat().st_size
    assert size < 1 << 18
    message = refusal(file)
    assert message.startswith(f"a file of {size:,} bytes that inflates to 134,2")
    assert message.endswith(", limit 67,108,864: no image of a network does; compile it again")


@pytest.mark.parametrize(
    ("array", "found"),
    [
        (np.array(["x"]), "<U1"),
        (np.zeros(3, dtype="<i8"), "<i8"),
        (np.zeros(1, dtype=[("a", "<i4")]), "|V4"),
    ],
)
def test_an_array_of_another_type_is_refused(array: np.ndarray, found: str, file: Path) -> None:
    rewrite(file, lambda members: members.update(bias=array))
    assert refusal(file) == f"array bias is of type {found}, not <i4; compile it again"


def test_an_array_whose_header_claims_more_than_it_holds_is_refused(file: Path) -> None:
    """NumPy would allocate the size in an array's header before it reads any of the array."""
    with zipfile.ZipFile(file) as archive:
        members = {info.filename: archive.read(info) for info in archive.infolist()}
    head = members["bias.npy"]
    members["bias.npy"] = head.replace(b"(66,)", b"(9" + b"9" * 9 + b",)", 1)[: len(head)]
    assert members["bias.npy"] != head
    with zipfile.ZipFile(file, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    assert refusal(file) == DAMAGED


@pytest.mark.parametrize(
    ("entry", "value", "reason"),
    [
        (
            "blocks",
            [{"kind": "soma", "owner": "a", "piece": [], "cut": []}],
            "manifest.blocks.0.kind",
        ),
        ("blocks", [{"label": "a"}], "manifest.blocks.0.kind: field required"),
        ("blocks", [{"kind": "soma", "owner": "a"}], "manifest.blocks.0.kind"),
        ("dt_s", "fast", "manifest.dt_s: input should be a valid number"),
        ("taste", 1, "manifest.taste: unexpected keyword argument"),
    ],
)
def test_a_manifest_of_another_form_is_refused(
    entry: str, value: object, reason: str, file: Path
) -> None:
    def change(members: dict[str, np.ndarray]) -> None:
        header = json.loads(bytes(members["header"]))
        header["manifest"][entry] = value
        members["header"] = pack(header)

    rewrite(file, change)
    message = refusal(file)
    assert message.startswith(reason)
    assert message.endswith("; compile it again")


def test_a_manifest_that_is_nested_too_deeply_is_refused(file: Path) -> None:
    def change(members: dict[str, np.ndarray]) -> None:
        members["header"] = np.frombuffer(b"[" * 100_000, np.uint8)

    rewrite(file, change)
    assert refusal(file) == DAMAGED


def test_a_manifest_that_would_fill_the_memory_is_refused(file: Path) -> None:
    """Lists take fifty times the memory of their text, and the text inflates a hundredfold."""

    def change(members: dict[str, np.ndarray]) -> None:
        members["header"] = np.frombuffer(b"[1]," * (MOST_PARTS + 1), np.uint8)

    rewrite(file, change)
    tracemalloc.start()
    assert refusal(file) == DAMAGED
    assert tracemalloc.get_traced_memory()[1] < 8 * len("[1],") * MOST_PARTS
    tracemalloc.stop()


def test_a_text_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("this is not an image")
    assert refusal(path) == DAMAGED


def test_a_single_array_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "array.npy"
    np.save(path, np.arange(3))
    assert refusal(path) == DAMAGED


def test_a_file_of_foreign_arrays_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "arrays.npz"
    np.savez(path, weights=np.arange(3))
    assert refusal(path) == DAMAGED


def test_a_file_with_an_altered_weight_is_refused(file: Path) -> None:
    def change(members: dict[str, np.ndarray]) -> None:
        members["weights"][0] += 64

    rewrite(file, change)
    assert refusal(file) == (
        "the content does not match its digest: the file was altered; compile it again"
    )


def test_a_file_with_an_altered_manifest_is_refused(file: Path) -> None:
    def change(members: dict[str, np.ndarray]) -> None:
        header = json.loads(bytes(members["header"]))
        header["manifest"]["dt_s"] = 0.5
        members["header"] = pack(header)

    rewrite(file, change)
    assert refusal(file) == (
        "the content does not match its digest: the file was altered; compile it again"
    )


def test_a_file_that_lacks_an_array_is_refused(file: Path) -> None:
    rewrite(file, lambda members: members.pop("vth"))
    assert refusal(file) == "image arrays do not follow schema 2: vth"


@pytest.mark.parametrize(
    ("header", "schema"),
    [
        ({"manifest": {"schema": SCHEMA + 1}}, SCHEMA + 1),
        ({"manifest": {"schema": 1}}, 1),
        ({"manifest": {}}, None),
        ({"manifest": [1]}, None),
        ({}, None),
        ([1], None),
    ],
    ids=repr,
)
def test_an_unknown_schema_is_refused(header: Any, schema: int | None, tmp_path: Path) -> None:
    path = tmp_path / "image"
    with open(path, "wb") as stream:
        np.savez(stream, header=pack(header))
    assert refusal(path) == f"image schema {schema}, this spikeport reads 2; compile it again"


@pytest.mark.parametrize("arithmetic", ["loihi-3", None])
def test_an_image_for_a_chip_of_another_arithmetic_is_refused(
    image: ChipImage, arithmetic: str | None, tmp_path: Path
) -> None:
    manifest = replace(image.manifest, chip="another", arithmetic=arithmetic)
    replace(image, manifest=manifest).save(tmp_path / "image")
    assert refusal(tmp_path / "image") == (
        f"an image for chip 'another' that computes as '{arithmetic}', this spikeport as "
        "'nengo-loihi 1.1'; compile the network for a chip that `spikeport chips` lists"
    )


def test_a_save_that_fails_leaves_the_old_file_and_nothing_else(
    image: ChipImage, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = file.read_bytes()

    def fail(stream: Any, **_members: Any) -> None:
        stream.write(b"half of an image")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", fail)
    with pytest.raises(OSError, match="No space left on device"):
        replace(image, manifest=replace(image.manifest, dt_s=0.5)).save(file)
    assert file.read_bytes() == before
    assert list(file.parent.iterdir()) == [file]
