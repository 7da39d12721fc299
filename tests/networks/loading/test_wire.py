"""Malformed and endless bytes in ONNX files."""

import pytest


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"\x3a\x80\x89\x7a" + b"\x0a\x00" * 1_000_000, "more than 100,000 fields"),
        (b"\x08\x01" * 1_000_000, "more than 100,000 fields"),
        (b"\x3a\xff\xff\xff\xff\x7f", "bytes where 0 are left"),
        (b"\xff" * 100, "a number without an end"),
        (b"\x0b\x0c", "a field of kind 3"),
        (b"\x38\x01", "a number in place of bytes"),
        (b"", "0 graphs"),
    ],
)
def test_endless_or_malformed_bytes_are_refused(model, refused, content, complaint):
    path = model()
    path.write_bytes(content)
    assert complaint in refused(path)
