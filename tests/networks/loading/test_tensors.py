"""Tensors whose sizes do not fit their storage."""

import io
import pickle
from collections.abc import Callable

import pytest
import torch

from tests.helpers.foreign import pack


@pytest.fixture
def path(tmp_path):
    return tmp_path / "policy.pt"


def storage_pickle(**changes: object) -> bytes:
    """Return a checkpoint's pickle of a tensor with other sizes than its own."""
    sizes = {"count": 20, "offset": 0, "shape": (4, 5), "strides": (5, 1), **changes}

    class Storage:
        pass

    class Pickler(pickle.Pickler):
        def persistent_id(self, value: object) -> object:
            if not isinstance(value, Storage):
                return None
            return ("storage", torch.FloatStorage, "0", "cpu", sizes["count"])

    class Rebuilt:
        def __reduce__(self) -> tuple[Callable[..., object], tuple[object, ...]]:
            arguments = (Storage(), sizes["offset"], sizes["shape"], sizes["strides"], False, {})
            return torch._utils._rebuild_tensor_v2, arguments

    stream = io.BytesIO()
    state = {
        "mlp.0.weight": Rebuilt(),
        "mlp.0.bias": Rebuilt(),
        "distribution.std_param": Rebuilt(),
    }
    Pickler(stream, 2).dump({"actor_state_dict": state})
    return stream.getvalue()


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"count": 2**40}, "at most 8,388,608 numbers in storage 0"),
        ({"count": 10**5000}, "another identifier"),
        ({"count": -1}, "another identifier"),
        ({"count": 21}, "84 bytes in storage 0, found 80"),
        ({"offset": 1}, "one beyond it"),
        ({"offset": -4}, "sizes and strides are integers from 0 to 2^63 - 1, found other values"),
        ({"shape": (2**40, 2**40), "strides": (0, 0)}, "axes of at most"),
        ({"shape": (100, 100), "strides": (0, 0)}, "at most 20 numbers"),
        ({"shape": (2**40, 0), "strides": (0, 0)}, "axes of at most 8,388,608"),
        ({"shape": (4, 5), "strides": (2**62, 1)}, "one beyond it"),
        (
            {"shape": (4, 5), "strides": (-5, 1)},
            "sizes and strides are integers from 0 to 2^63 - 1, found other values",
        ),
        (
            {"shape": (4.0, 5)},
            "sizes and strides are integers from 0 to 2^63 - 1, found other values",
        ),
        (
            {"shape": (4, 5, 1)},
            "one stride for each size, at most 8 axes, found 3 sizes, 2 strides",
        ),
        ({"shape": (1,) * 64, "strides": (1,) * 64}, "at most 8 axes, found 64 sizes, 64 strides"),
        ({"shape": [4, 5]}, "a tensor of a storage, sizes and strides, found other arguments"),
        (
            {"shape": (10**5000, 5)},
            "sizes and strides are integers from 0 to 2^63 - 1, found other values",
        ),
    ],
)
def test_tensors_that_do_not_fit_their_storage_are_refused(path, refused, changes, complaint):
    pack(path, {"policy/data.pkl": storage_pickle(**changes), "policy/data/0": bytes(80)})
    assert complaint in refused(path)
