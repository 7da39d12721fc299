"""Zip archives: the list of members that is checked is the one that Python reads."""

import io
import struct
import zipfile

import pytest

from spikeport.reading.archive import Archive
from spikeport.reading.mismatch import MismatchError

RECORD = "<4sQ2H2L4Q"
LOCATOR = "<4sLQL"


def in_zip64(offset: int = 0, between: bytes = b"") -> bytes:
    """Return an archive of one member in ZIP64, its locator changed by ``offset``."""
    with zipfile.ZipFile(file := io.BytesIO(), "w") as archive:
        archive.writestr("a", b"content")
    content = file.getvalue()
    size, start = struct.unpack("<2L", content[-10:-2])
    record = struct.pack(RECORD, b"PK\6\6", 44, 45, 45, 0, 0, 1, 1, size, start)
    locator = struct.pack(LOCATOR, b"PK\6\7", 0, len(content) - 22 + offset, 1)
    return content[:-22] + record + between + locator + content[-22:]


def test_an_archive_in_zip64_is_read():
    assert Archive(in_zip64()).read("a", 100) == b"content"


@pytest.mark.parametrize("content", [in_zip64(offset=-1), in_zip64(between=bytes(4))])
def test_a_record_that_is_not_before_its_locator_is_refused(content):
    with pytest.raises(MismatchError) as caught:
        Archive(content)
    assert str(caught.value) == (
        "expected ZIP64's record directly before its locator, found it elsewhere"
    )
