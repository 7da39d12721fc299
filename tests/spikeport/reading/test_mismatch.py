from spikeport.reading.mismatch import SHOWN, MismatchError, first_line


def test_a_refusal_is_one_line_of_printable_characters():
    error = MismatchError("a name", "a\nb\x1b[2J")
    assert str(error) == r"expected a name, found a\nb\x1b[2J"
    assert error.cure is None


def test_a_refusal_shows_only_the_beginning_of_a_long_text():
    text = str(MismatchError("a name", "x" * 10_000, cure="shorten it"))
    assert text == f"expected a name, found {'x' * SHOWN}..."


def test_an_error_has_a_first_line_with_or_without_a_text():
    assert first_line(ValueError("no zip\nat byte 3")) == "no zip"
    assert first_line(MemoryError()) == "MemoryError"
