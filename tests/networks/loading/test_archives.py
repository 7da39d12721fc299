"""Archives that inflate without end, lead elsewhere, or are damaged."""

import os
import re
import struct
import tracemalloc
import zipfile
from pathlib import Path

import pytest
import torch

from spikeport.networks import walking_policy
from spikeport.reading import archive
from spikeport.reading.mismatch import MismatchError
from tests.helpers.foreign import Policy, members, pack, state

pytestmark = pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning")


@pytest.fixture
def path(tmp_path):
    return tmp_path / "policy.pt"


@pytest.fixture(params=["TorchScript", "checkpoint", "npz"])
def zipped(request, tmp_path) -> Path:
    """Return a good file of every format that is a zip archive."""
    made = tmp_path / "policy.zip"
    if request.param == "npz":
        made.write_bytes(walking_policy.SHIPPED.read_bytes())
    elif request.param == "checkpoint":
        torch.save({"actor_state_dict": state()}, made)
    else:
        torch.jit.script(Policy()).save(made)
    return made


def test_a_truncated_archive_is_refused(zipped, refused):
    whole = zipped.read_bytes()
    for part in (0.1, 0.5, 0.9, 0.99, 0.999):
        zipped.write_bytes(whole[: int(part * len(whole))])
        refused(zipped)


@pytest.mark.parametrize("name", ["../up", "/etc/passwd", "a/../../b", "a\\b"])
def test_names_that_lead_out_of_the_archive_are_refused(zipped, refused, name):
    with zipfile.ZipFile(zipped, "a") as added:
        added.writestr(name, b"")
    assert refused(zipped).startswith(f"expected members inside the archive, found {name}")


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_doubled_members_are_refused(zipped, refused):
    with zipfile.ZipFile(zipped, "a") as added:
        name = added.namelist()[0]
        added.writestr(name, b"")
    assert refused(zipped).startswith(f"expected members of different names, found 2 of {name}")


def largest(path: Path) -> zipfile.ZipInfo:
    with zipfile.ZipFile(path) as read:
        pickles = [i for i in read.infolist() if i.filename.endswith((".pkl", "weights_0.npy"))]
    return max(pickles, key=lambda info: info.file_size)


BOMB_BYTES = 120_000_000


def bomb(path: Path, claimed: int | None) -> str:
    """Let a member inflate to 120 MB, whatever size it states, and return its name."""
    name, content = largest(path).filename, members(path)
    pack(path, {**content, name: bytes(BOMB_BYTES)})
    if claimed is not None:
        written = bytearray(path.read_bytes())
        with zipfile.ZipFile(path) as read:
            info = read.getinfo(name)
        place = written.rfind(name.encode()) - 46
        assert struct.unpack_from("<I", written, place + 24) == (BOMB_BYTES,)
        struct.pack_into("<I", written, place + 24, claimed)
        struct.pack_into("<I", written, info.header_offset + 22, claimed)
        path.write_bytes(written)
    return name


@pytest.mark.slow
@pytest.mark.parametrize("claimed", [None, 1000, 2**32 - 2])
def test_members_inflate_no_further_than_is_allowed(zipped, refused, claimed):
    bomb(zipped, claimed)
    tracemalloc.start()
    try:
        assert re.search("expected at most|a whole zip archive", refused(zipped))
        assert tracemalloc.get_traced_memory()[1] < 100_000_000
    finally:
        tracemalloc.stop()


def test_all_members_together_are_limited(path):
    torch.save({"actor_state_dict": state()}, path)
    read = archive.Archive(path.read_bytes(), limit=100)
    read.read("policy/data/0", 10_000)
    with pytest.raises(MismatchError, match="expected at most 100 bytes in all members together"):
        read.read("policy/data/2", 10_000)


@pytest.mark.parametrize("long", [False, True])
def test_an_oversized_list_of_members_is_refused(path, refused, long):
    entries = b"PK\1\2" + bytes(42)
    content, count = entries * 50_000, 50_000
    end = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 0, 0, len(content) * (not long), 0, 0)
    if long:
        record = (b"PK\6\6", 44, 45, 45, 0, 0, count, count, len(content), 0)
        locator = struct.pack("<4sLQL", b"PK\6\7", 0, len(content), 1)
        end = struct.pack("<4sQ2H2L4Q", *record) + locator + end
    path.write_bytes(content + end)
    assert refused(path).startswith(
        "expected a list of members of at most 1,048,576 bytes, found 2,300,000"
    )


def test_an_archive_on_several_disks_is_refused(path, refused):
    locator = struct.pack("<4sLQL", b"PK\6\7", 0, 0, 2)
    path.write_bytes(b"PK\6\6" + bytes(52) + locator + b"PK\5\6" + bytes(18))
    assert "multiple disks" in refused(path)


def changed(path: Path, place: int, value: int) -> None:
    """Set two bytes of the largest member's header and of its entry in the list of members."""
    written, info = bytearray(path.read_bytes()), largest(path)
    entry = written.rfind(info.filename.encode()) - 46
    struct.pack_into("<H", written, entry + place + 2, value)
    struct.pack_into("<H", written, info.header_offset + place, value)
    path.write_bytes(written)


@pytest.mark.parametrize("kind", [1, 9, 12, 14, 95, 99])
def test_other_compressions_are_refused(zipped, refused, kind):
    changed(zipped, 8, kind)
    assert f"found compression {kind};" in refused(zipped)


def test_encrypted_members_are_refused(zipped, refused):
    changed(zipped, 6, 1)
    assert "encrypted" in refused(zipped)


def test_damaged_compression_is_refused(zipped, refused):
    pack(zipped, members(zipped))
    info, written = largest(zipped), bytearray(zipped.read_bytes())
    start = info.header_offset + 30 + len(info.filename)
    written[start : start + 40] = b"\xff" * 40
    zipped.write_bytes(written)
    assert refused(zipped).startswith("expected a whole zip archive, found ")


def test_a_pipe_is_refused_and_not_waited_for(path, refused):
    os.mkfifo(path)
    assert refused(path).startswith("expected a file, found a pipe or a device")
