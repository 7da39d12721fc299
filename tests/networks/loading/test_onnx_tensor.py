"""Tensors of ONNX files, in the model and beside it."""

import os
from collections.abc import Callable

import numpy as np
import onnx
import pytest
from onnx import TensorProto

from spikeport.networks.loading.files import files_of, load_mlp


def external(location: str, **entries: object) -> Callable[[onnx.ModelProto], None]:
    def change(made: onnx.ModelProto) -> None:
        tensor = made.graph.initializer[0]
        tensor.ClearField("raw_data")
        tensor.data_location = TensorProto.EXTERNAL
        for key, value in {"location": location, **entries}.items():
            entry = tensor.external_data.add()
            entry.key, entry.value = key, str(value)

    return change


def test_weights_in_a_file_beside_the_model_are_read(model, watched, tmp_path):
    whole = load_mlp(model())
    weights = np.arange(20, dtype=np.float32)
    (tmp_path / "weights.bin").write_bytes(b"1234" + weights.tobytes())
    path = model(external("weights.bin", offset=4, length=80))
    watched(lambda: load_mlp(path))
    np.testing.assert_array_equal(load_mlp(path).layers[0].weights, weights.reshape(4, 5))
    np.testing.assert_array_equal(load_mlp(path).layers[1].weights, whole.layers[1].weights)


def test_files_with_weights_are_files_of_the_policy(model, tmp_path):
    assert files_of(model()) == [tmp_path / "policy.onnx"]
    (tmp_path / "weights.bin").write_bytes(bytes(80))
    path = model(external("weights.bin", length=80))
    assert files_of(path) == [path, tmp_path / "weights.bin"]


def test_files_of_unused_tensors_are_not_files_of_the_policy(model):
    def unused(made: onnx.ModelProto) -> None:
        made.graph.initializer.add().CopyFrom(made.graph.initializer[0])
        external("sub/w.bin")(made)
        made.graph.initializer[0].name = "unused"

    path = model(unused)
    assert load_mlp(path).sizes == (5, 4, 3)
    assert files_of(path) == [path]


def test_listing_the_files_of_a_damaged_model_is_refused(model, refused):
    path = model()
    path.write_bytes(path.read_bytes()[:-7])
    assert "a damaged one" in refused(path, files_of)


@pytest.mark.parametrize("kind", [TensorProto.FLOAT16, TensorProto.BFLOAT16])
@pytest.mark.parametrize("raw", [False, True])
def test_numbers_of_16_bits_are_read(model, kind, raw):
    values = np.arange(-10, 10) / 4

    def change(made: onnx.ModelProto) -> None:
        halves = onnx.helper.make_tensor("W", kind, (4, 5), values)
        assert halves.int32_data
        if raw:
            bits = np.array(halves.int32_data, "<u2")
            halves.ClearField("int32_data")
            halves.raw_data = bits.tobytes()
        made.graph.initializer[0].CopyFrom(halves)

    weights = load_mlp(model(change)).layers[0].weights
    np.testing.assert_array_equal(weights, values.reshape(4, 5))


@pytest.mark.parametrize(
    ("location", "entries", "complaint"),
    [
        ("/etc/passwd", {}, "a file beside the model, found '/etc/passwd'"),
        ("../secret", {}, "a file beside the model, found '../secret'"),
        ("sub/../../secret", {}, "a file beside the model"),
        ("..", {}, "a file beside the model"),
        ("", {}, "a file beside the model"),
        ("a\0b", {}, "a file beside the model"),
        ("link", {}, "numbers in link, found none (Too many levels of symbolic links)"),
        ("fifo", {}, "a file fifo, found a pipe or a device"),
        ("none", {}, "numbers in none, found none (No such file or directory)"),
        ("folder", {}, "found none (Is a directory)"),
        ("weights.bin", {"offset": -4}, "an offset into weights.bin, found -4"),
        ("weights.bin", {"offset": "9" * 9999}, "an offset into weights.bin, found 999"),
        ("weights.bin", {"offset": "x"}, "an offset into weights.bin, found x"),
        ("weights.bin", {"offset": 10**9}, "20 numbers in W, found 0"),
        ("weights.bin", {"offset": 40}, "20 numbers in W, found 10"),
        ("n" * 5000, {}, "File name too long"),
    ],
)
def test_weights_in_files_elsewhere_missing_or_too_short_are_refused(
    model, refused, tmp_path, location, entries, complaint
):
    (tmp_path / "weights.bin").write_bytes(bytes(80))
    (tmp_path / "secret").write_bytes(bytes(80))
    (tmp_path / "link").symlink_to(tmp_path / "secret")
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "fifo")
    assert complaint in refused(model(external(location, **entries)))


def tensor(**fields: object) -> Callable[[onnx.ModelProto], None]:
    def change(made: onnx.ModelProto) -> None:
        for name, value in fields.items():
            if isinstance(value, list):
                made.graph.initializer[0].ClearField(name)
                getattr(made.graph.initializer[0], name).extend(value)
            else:
                setattr(made.graph.initializer[0], name, value)

    return change


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (tensor(data_type=TensorProto.STRING, raw_data=b""), "values of type 8"),
        (tensor(data_type=TensorProto.STRING, string_data=[b"a"] * 20), "values of type 8"),
        (tensor(data_type=99), "values of type 99"),
        (tensor(data_type=0), "values of type 0"),
        (tensor(data_type=TensorProto.FLOAT8E4M3FN), "values of type 17"),
        (tensor(data_type=TensorProto.COMPLEX64), "values of type 14"),
        (tensor(dims=[4, -5]), "at most 8 axes, each from 0 to 8,388,608, in W, found other sizes"),
        (
            tensor(dims=[2**62, 2**62]),
            "at most 8 axes, each from 0 to 8,388,608, in W, found other sizes",
        ),
        (tensor(dims=[2**20, 2**20]), "at most 8,388,608 numbers in W"),
        (
            tensor(dims=[1] * 5000),
            "at most 8 axes, each from 0 to 8,388,608, in W, found other sizes",
        ),
        (tensor(dims=[0, 5]), "0 numbers in W, found 20"),
        (tensor(dims=[4, 6]), "24 numbers in W, found 20"),
        (
            tensor(data_type=TensorProto.FLOAT16, raw_data=b"", int32_data=[2**16] * 20),
            "expected numbers of 16 bits in W, found larger ones",
        ),
        (tensor(raw_data=b"123"), "a multiple of 4 bytes, found 3 bytes"),
    ],
)
def test_tensors_of_unsupported_types_or_wrong_sizes_are_refused(model, refused, change, complaint):
    assert complaint in refused(model(change))
