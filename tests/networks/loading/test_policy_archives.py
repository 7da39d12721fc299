"""Archives of arrays, which hold only numbers and texts, of the sizes that they state."""

import os
import pickle
import struct

import numpy as np
import pytest

from spikeport.networks import walking_policy
from spikeport.networks.loading.files import load_mlp
from tests.helpers.foreign import Reduced, members, pack


@pytest.fixture
def arrays() -> dict[str, np.ndarray]:
    with np.load(walking_policy.SHIPPED) as shipped:
        return dict(shipped)


def header(shape: str, kind: str = "'<f8'", columns: str = "False") -> bytes:
    text = f"{{'descr': {kind}, 'fortran_order': {columns}, 'shape': {shape}, }}".encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text


LOADERS = {"load": walking_policy.load, "load_mlp": load_mlp}


@pytest.mark.parametrize("loader", LOADERS)
@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (
            {"weights_0": np.array([{}], dtype=object)},
            "numbers or texts in weights_0.npy, found ty",
        ),
        ({"weights_0": np.zeros(3, [("a", "f8"), ("b", "i4")])}, "numbers or texts in weights_0.n"),
        ({"weights_0": np.zeros((128, 69), dtype=complex)}, "numbers or texts in weights_0.npy"),
        ({"weights_0": np.zeros((128, 69), dtype="M8[s]")}, "numbers or texts in weights_0.npy"),
        ({"weights_0": np.zeros((128, 69), dtype="S4")}, "numbers or texts in weights_0.npy"),
        ({"weights_0": np.full((128, 69), "1")}, "numbers in 2 axes as weights_0, found <U1 in 2"),
        ({"weights_0": np.zeros((1, 128, 69))}, "numbers in 2 axes as weights_0"),
        ({"weights_0": np.array(1.0)}, "numbers in 2 axes as weights_0"),
        ({"weights_0": np.zeros((128, 69), dtype=bool)}, "numbers in 2 axes as weights_0"),
        ({"biases_0": np.array(1.0)}, "numbers in 1 axes as biases_0"),
        ({"joints": np.array("hip")}, "texts in 1 axes as joints"),
        ({"joints": np.zeros(19)}, "texts in 1 axes as joints"),
        ({"pose_rad": np.full(19, "a")}, "numbers in 1 axes as pose_rad"),
        ({"action_scale_rad": np.zeros(2)}, "numbers in 0 axes as action_scale_rad"),
        ({"activation": np.frombuffer(b"\xff" * 12, "<U3").reshape(())}, "invalid code points"),
        ({"activation": np.array(1)}, "texts in 0 axes as activation"),
        ({"activation": np.array("\x1b[2J")}, "activation elu, found activation"),
        ({"weights_x": np.zeros((2, 2))}, "weights of 5 layers, found no weights_4"),
    ],
)
def test_arrays_of_wrong_types_or_shapes_are_refused(
    tmp_path, arrays, refused, loader, change, complaint
):
    path = tmp_path / "policy.npz"
    np.savez(path, **{**arrays, **change})
    assert complaint in refused(path, LOADERS[loader])


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"", "an array weights_0.npy, found none"),
        (b"just a text", "an array weights_0.npy, found none"),
        (b"\x93NUMPY\x09\x00", "an array weights_0.npy, found none"),
        (header("(10**9,)"), "an array weights_0.npy, found none"),
        (header("(1000000000,)"), "axes of 0 to 8,388,608 in weights_0.npy, found 1,000,"),
        (header("(-1,)"), "axes of 0 to 8,388,608 in weights_0.npy, found -1"),
        (header("(1,) " + "* 1" * 10), "an array weights_0.npy, found none"),
        (header(f"({'1,' * 64})"), "an array of at most 8 axes in weights_0.npy, found 64"),
        (header("(3,)"), "3 values of float64 in weights_0.npy, found another size"),
        (header("(0,)") + bytes(8), "0 values of float64 in weights_0.npy, found another size"),
        (header("(1,)", "'|O'") + bytes(8), "numbers or texts in weights_0.npy, found type object"),
        (header("(1,)", "'<U2147483647'"), "an array weights_0.npy, found none"),
        (header("(1,)", "'<U99999999999'"), "an array weights_0.npy, found none"),
        (header("(1,)", "'(9,9)f8'"), "numbers or texts in weights_0.npy"),
        (header("(" * 3000), "an array weights_0.npy, found none"),
        (header("(1,)", "__import__('os').system('touch harm')"), "an array weights_0.npy, found"),
        (header("(1,)", columns="{}"), "an array weights_0.npy, found none"),
        (header("(1,)", "{[]: 1}"), "an array weights_0.npy, found none"),
        (b"\x93NUMPY\x01\x00\xff\xff" + b" " * 65535, "an array weights_0.npy, found none"),
        (pickle.dumps(Reduced(os.system, "touch harm")), "an array weights_0.npy, found none"),
    ],
)
def test_members_that_are_not_valid_arrays_are_refused(
    tmp_path, monkeypatch, refused, content, complaint
):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "policy.npz"
    written = {**members(walking_policy.SHIPPED), "weights_0.npy": content}
    pack(path, written)
    assert complaint in refused(path)
    assert os.listdir() == [path.name]


def test_a_big_endian_array_of_float32_in_fortran_order_is_read(tmp_path, arrays):
    path = tmp_path / "policy.npz"
    weights = np.asfortranarray(arrays["weights_0"]).astype(">f4")
    np.savez(path, **{**arrays, "weights_0": weights})
    np.testing.assert_array_equal(walking_policy.load(path).weights[0], weights)
