"""Texts of others: JSON, TOML and tables, of a size and in an encoding that is known."""

import codecs
from pathlib import Path

from spikeport.reading.archive import read_bytes
from spikeport.reading.mismatch import MismatchError

TEXT_BYTES = 2**26
"""Size of the largest text that is read, 64 MiB: the report of an image of 100,000 blocks."""

MARKS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
"""Marks at the begin of a file and the encodings that they stand for; spreadsheets write them."""


def read_text(path: Path, limit: int = TEXT_BYTES) -> str:
    """Return the text of a file, in UTF-8 or in the encoding that its first bytes name.

    Raises
    ------
    MismatchError
        If it is too large, or no text.
    OSError
        If it cannot be read.
    """
    content = read_bytes(path, limit)
    encoding = next((name for mark, name in MARKS.items() if content.startswith(mark)), "utf-8")
    try:
        return content.decode(encoding)
    except UnicodeDecodeError as error:
        raise MismatchError(f"a text in {encoding}", str(error)) from error
