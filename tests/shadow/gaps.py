"""Parts that nengo-loihi's tests need, and that Nengo 4, NumPy 2 and its wheel lack."""

import pickle
import sys
import types
from pathlib import Path
from typing import Any

import nengo.builder.transforms
import nengo_loihi.builder.discretize
import nengo_loihi.dvs
import numpy as np

from spikeport.compile.loihi.numpy1 import WideMax


def fill_gaps() -> None:
    """Fill all gaps that can be filled before tests are collected."""
    bring_back_npconv2d()
    bring_back_fromstring()
    widen_largest_values()


def bring_back_npconv2d() -> None:
    """Provide the module that convolutions' tests import: Nengo 4 moved its functions."""
    package: Any = types.ModuleType("nengo._vendor.npconv2d")
    package.conv2d = nengo.builder.transforms
    nengo._vendor.npconv2d = package
    sys.modules["nengo._vendor.npconv2d"] = package
    sys.modules["nengo._vendor.npconv2d.conv2d"] = nengo.builder.transforms


class _WithFromstring:
    """The numpy module, with a function that NumPy 2.3 removed."""

    def __getattr__(self, name: str) -> Any:
        return getattr(np, name)

    @staticmethod
    def fromstring(data: bytes, dtype: type) -> np.ndarray:
        return np.frombuffer(data, dtype).copy()


def bring_back_fromstring() -> None:
    """Restore the name that the reader of event camera files uses."""
    nengo_loihi.dvs.np = _WithFromstring()


def widen_largest_values() -> None:
    """Compute scales from the largest bias and threshold in float64, as under NumPy 1."""
    discretize = nengo_loihi.builder.discretize.discretize_block

    def discretize_wide(block: Any) -> Any:
        block.compartment.bias = block.compartment.bias.view(WideMax)
        block.compartment.vth = block.compartment.vth.view(WideMax)
        return discretize(block)

    nengo_loihi.builder.discretize.discretize_block = discretize_wide


def draw_pictures(test_conv: Any, folder: Path) -> None:
    """Write ten strokes of a pen in place of ten pictures of digits, which the package lacks."""
    with open(folder / "mnist10.pkl", "wb") as file:
        pictures = np.stack([_stroke(i).ravel() for i in range(10)]).astype(np.float32)
        pickle.dump((pictures, np.arange(10)), file)
    test_conv.test_dir = str(folder)


def _stroke(i: int) -> np.ndarray:
    """Return a closed curve of i + 1 loops, 28 x 28, bright where the pen was near."""
    t = np.linspace(0, 2 * np.pi, 200)
    pen_x, pen_y = 14 + 8 * np.sin((i + 1) * t), 14 + 9 * np.cos((i + 2) * t)
    y, x, _ = np.mgrid[:28, :28, :1]
    squared = (x - pen_x) ** 2 + (y - pen_y) ** 2
    return np.exp(-squared.min(axis=2) / 2)
