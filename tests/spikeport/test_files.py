import json

import numpy as np
import pytest
from pydantic import BaseModel

from spikeport.errors import ChipFileError, UsageError
from spikeport.files import read_json, read_model, read_toml, write_arrays, write_json
from spikeport.reading import npz

READERS = [(read_toml, "TOML", "a = 1\n"), (read_json, "JSON", '{"a": 1}\n')]


class Size(BaseModel):
    width: int
    height: int


class Strict(Size, extra="forbid"):
    """A size, and nothing else."""


@pytest.mark.parametrize(("read", "kind", "text"), READERS)
def test_a_file_of_toml_or_json_is_read(tmp_path, read, kind, text):
    path = tmp_path / "file"
    path.write_text(text, encoding="utf-8")
    assert read(path) == {"a": 1}


@pytest.mark.parametrize(("read", "kind", "text"), READERS)
def test_a_file_that_cannot_be_read_is_refused_with_path_and_reason(tmp_path, read, kind, text):
    def refusal(path):
        with pytest.raises(UsageError) as caught:
            read(path)
        return str(caught.value)

    path = tmp_path / "file"
    assert refusal(path) == f"{path}: no such file"
    assert refusal(tmp_path) == f"{tmp_path}: cannot be read: Is a directory"
    path.write_text("{", encoding="utf-8")
    assert refusal(path).startswith(f"{path}: not {kind}: ")
    path.write_bytes(b"a\xff")
    expected = "expected a text in utf-8, found 'utf-8' codec can't decode byte 0xff"
    assert refusal(path).startswith(f"{path}: not {kind}: {expected}")
    path.write_text("a = " + "[" * 3000 if kind == "TOML" else "[" * 100_000, encoding="utf-8")
    assert refusal(path) == f"{path}: not {kind}: it is nested too deeply; write it flat"


@pytest.mark.parametrize(("read", "kind", "text"), READERS)
def test_a_refusal_has_the_error_class_that_the_caller_names(tmp_path, read, kind, text):
    with pytest.raises(ChipFileError):
        read(tmp_path / "file", ChipFileError)


def test_every_mismatch_with_a_model_is_listed(tmp_path):
    path = tmp_path / "size.toml"
    path.write_text("width = 3\nheight = 4\n", encoding="utf-8")
    assert read_model(path, Size, "size") == Size(width=3, height=4)
    path.write_text('width = "wide"\n', encoding="utf-8")
    with pytest.raises(UsageError) as caught:
        read_model(path, Size, "size")
    assert str(caught.value) == (
        f"{path}: not a size:\n"
        "  width: Input should be a valid integer, unable to parse string as an integer\n"
        "  height: is missing"
    )


def test_long_keys_and_long_lists_of_mismatches_are_cut(tmp_path):
    path = tmp_path / "size.toml"
    wrong = "x" * 10_000
    path.write_text("".join(f"{wrong}{i} = 1\n" for i in range(24)) + "width = 1\nheight = 2\n")
    with pytest.raises(UsageError) as caught:
        read_model(path, Strict, "size")
    rows = str(caught.value).splitlines()
    assert rows[1] == f"  {'x' * 400}...: is not a known key"
    assert len(rows) == 22
    assert rows[-1] == "  and 4 more"


def test_numpy_values_become_plain_json_and_nan_becomes_null(tmp_path):
    path = tmp_path / "file.json"
    write_json(path, {"a": np.int64(3), "b": np.bool_(True), "c": np.float32(0.5), 4: np.arange(2)})
    assert read_json(path) == {"a": 3, "b": True, "c": 0.5, "4": [0, 1]}
    write_json(path, {"odd": [float("nan"), np.float32("inf"), np.array([1.5, -np.inf])]})
    assert json.loads(path.read_text()) == {"odd": [None, None, [1.5, None]]}


def test_a_value_that_is_not_plain_raises_and_leaves_no_file(tmp_path):
    with pytest.raises(TypeError):
        write_json(tmp_path / "file.json", {"a": object()})
    assert list(tmp_path.iterdir()) == []


def test_arrays_are_written_under_the_name_as_it_is(tmp_path):
    path = tmp_path / "arrays"
    write_arrays(path, {"a": np.arange(3), "text": "elu", "number": 0.5})
    assert list(tmp_path.iterdir()) == [path]
    found = npz.read(path)
    assert found["a"].tolist() == [0, 1, 2]
    assert (found["text"].item(), found["number"].item()) == ("elu", 0.5)


def test_arrays_that_cannot_be_written_leave_no_file(tmp_path):
    with pytest.raises(ValueError, match="inhomogeneous"):
        write_arrays(tmp_path / "arrays.npz", {"a": [[1], [1, 2]]})
    assert list(tmp_path.iterdir()) == []
