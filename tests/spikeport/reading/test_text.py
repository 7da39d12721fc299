"""Users' texts: their encodings, and limits of their size."""

import os

import pytest

from spikeport.reading.mismatch import MismatchError
from spikeport.reading.text import MOST_PARTS, parse_json, parse_toml, read_text

TEXT = "t_s,x_m,y_m\n0,0,0\n1,µ,ß\n"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
def test_a_text_is_read_in_the_encoding_that_its_mark_names(tmp_path, encoding):
    path = tmp_path / "file"
    mark = "\ufeff" if encoding in ("utf-16-le", "utf-16-be") else ""
    path.write_bytes((mark + TEXT).encode(encoding))
    assert read_text(path) == TEXT


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"a\xff", "expected a text in utf-8, found 'utf-8' codec can't decode byte 0xff"),
        (b"\xff\xfea", "expected a text in utf-16, found 'utf-16"),
        (b"\xef\xbb\xbf\xff", "expected a text in utf-8-sig, found 'utf-8'"),
    ],
)
def test_bytes_that_cannot_be_decoded_are_refused(tmp_path, content, complaint):
    path = tmp_path / "file"
    path.write_bytes(content)
    with pytest.raises(MismatchError) as caught:
        read_text(path)
    assert str(caught.value).startswith(complaint)


def test_a_text_above_the_limit_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "file"
    with open(path, "wb") as file:
        file.truncate(2**40)  # a sparse file, which takes no room on the disk
    with pytest.raises(MismatchError) as caught:
        read_text(path)
    assert str(caught.value) == (
        "expected a file of at most 33,554,432 bytes, found 1,099,511,627,776"
    )


def test_a_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(MismatchError, match="expected a file, found a pipe or a device"):
        read_text(tmp_path / "pipe")


def test_json_and_toml_are_parsed():
    assert parse_json('{"a": [1.5]}') == {"a": [1.5]}
    assert parse_toml("a.b = [1.5]") == {"a": {"b": [1.5]}}


@pytest.mark.parametrize(
    ("parse", "text", "complaint"),
    [
        (
            parse_json,
            "[" * (MOST_PARTS + 1),
            "at most 1,048,576 lists and objects, found 1,048,577",
        ),
        (parse_toml, "a" * 300_000, "TOML of at most 262,144 characters, found 300,000"),
        (parse_toml, "a = 1\n" + "a." * 60 + "a = 1", "at most 50 dots in a line, found 60"),
        (parse_toml, "a.'\u2028'." * 30 + "a = 1", "at most 50 dots in a line, found 60"),
    ],
)
def test_texts_that_would_fill_the_memory_are_not_parsed(parse, text, complaint):
    with pytest.raises(MismatchError) as caught:
        parse(text)
    assert str(caught.value) == f"expected {complaint}"
