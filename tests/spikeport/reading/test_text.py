"""Texts of others: their encodings, and their size."""

import os

import pytest

from spikeport.reading.mismatch import MismatchError
from spikeport.reading.text import read_text

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
def test_bytes_that_are_no_text_are_refused(tmp_path, content, complaint):
    path = tmp_path / "file"
    path.write_bytes(content)
    with pytest.raises(MismatchError) as caught:
        read_text(path)
    assert str(caught.value).startswith(complaint)


def test_a_text_above_the_limit_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "file"
    with open(path, "wb") as file:
        file.truncate(2**40)  # a hole: it takes no room on the disk
    with pytest.raises(MismatchError) as caught:
        read_text(path)
    assert str(caught.value) == (
        "expected a file of at most 67,108,864 bytes, found 1,099,511,627,776"
    )


def test_a_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(MismatchError, match="expected a file, found a pipe or a device"):
        read_text(tmp_path / "pipe")
