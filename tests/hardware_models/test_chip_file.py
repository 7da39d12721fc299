"""Files of chips: read whole, or refused with all that is wrong."""

import pytest
from pydantic import BaseModel, ConfigDict, field_validator

from spikeport.errors import ChipFileError, UsageError
from spikeport.hardware_models.chip_file import read


class Part(BaseModel):
    """A part of a file."""

    model_config = ConfigDict(extra="forbid")
    size: int

    @field_validator("size")
    @classmethod
    def _even(cls, size: int) -> int:
        if size % 2:
            raise ValueError(f"must be even, not {size}")
        return size


class Thing(BaseModel):
    """A file."""

    model_config = ConfigDict(extra="forbid")
    name: str
    parts: list[Part] = []


@pytest.fixture
def path(tmp_path):
    return tmp_path / "thing.toml"


def refusal(path, **options):
    with pytest.raises(options.get("refusal", ChipFileError)) as caught:
        read(path, Thing, **options)
    return str(caught.value)


def test_a_file_becomes_its_model(path):
    path.write_text('name = "ä"\n[[parts]]\nsize = 2\n', encoding="utf-8")
    assert read(path, Thing) == Thing(name="ä", parts=[Part(size=2)])


def test_all_that_is_wrong_is_told_at_once(path):
    path.write_text("[[parts]]\nsize = 2\n[[parts]]\nsize = 3\ncolour = 1\n", encoding="utf-8")
    assert refusal(path, what="thing") == (
        f"{path}: not a thing:\n"
        "  name: is missing\n"
        "  parts.1.size: must be even, not 3\n"
        "  parts.1.colour: is not a known key"
    )


def test_a_file_that_cannot_be_read_is_named(path, tmp_path):
    assert refusal(path) == f"{path}: no such file"
    assert refusal(tmp_path) == f"{tmp_path}: cannot be read: Is a directory"
    path.write_bytes(b"\xff")
    assert refusal(path).startswith(f"{path}: not TOML: ")


def test_a_refusal_can_be_another(path):
    assert refusal(path, refusal=UsageError) == f"{path}: no such file"
