"""Untrusted texts: JSON, TOML and tables, of limited size and in a known encoding."""

import codecs
import json
import tomllib
from pathlib import Path
from typing import Any

from spikeport.reading.archive import read_bytes
from spikeport.reading.mismatch import MismatchError

TEXT_BYTES = 2**25
"""Size of the largest text that is read, 32 MiB: the report of an image of 80,000 blocks."""

MOST_PARTS = 2**20
"""Most lists and objects in JSON: three bytes of text can take a hundred and more in memory."""

TOML_BYTES = 2**18
"""Most bytes of a text of TOML: twenty times the largest that is shipped."""

MOST_DOTS = 50
"""Most dots in a line of TOML: the parser's cost grows with the square of the parts of a key."""

MARKS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
"""Marks at the beginning of a file and their encodings; spreadsheets write them."""


def read_text(path: Path, limit: int = TEXT_BYTES) -> str:
    """Return the text of a file, in UTF-8 or in the encoding that its first bytes name.

    Raises
    ------
    MismatchError
        If it is too large, or not text.
    UnreadableError
        If it cannot be read.
    """
    content = read_bytes(path, limit)
    encoding = next((name for mark, name in MARKS.items() if content.startswith(mark)), "utf-8")
    try:
        return content.decode(encoding)
    except UnicodeDecodeError as error:
        raise MismatchError(f"a text in {encoding}", str(error)) from error


def parse_json(text: str) -> Any:
    """Return the value of a JSON text.

    Raises
    ------
    MismatchError
        If it has too many parts, or is nested too deeply.
    ValueError, RecursionError
        If it is not JSON, or nested too deeply.
    """
    parts = text.count("[") + text.count("{")
    if parts > MOST_PARTS:
        raise MismatchError(f"at most {MOST_PARTS:,} lists and objects", f"{parts:,}")
    return json.loads(text)


def parse_toml(text: str) -> dict[str, Any]:
    """Return the content of a TOML text; raises as `parse_json`."""
    if len(text) > TOML_BYTES:
        raise MismatchError(f"TOML of at most {TOML_BYTES:,} characters", f"{len(text):,}")
    # Not `splitlines`: letters that end a line elsewhere may lie within a line of TOML.
    most = max(line.count(".") for line in text.split("\n"))
    if most > MOST_DOTS:
        raise MismatchError(f"at most {MOST_DOTS} dots in a line", f"{most:,}")
    return tomllib.loads(text)
