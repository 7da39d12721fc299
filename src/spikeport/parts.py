"""Objects that are parts of others: a copy of both has to keep that.

An array can be a view of another one. A robot often keeps parts of its simulation, such as
``data.qpos`` or ``data.joint("hinge")``, which follow the state of MuJoCo's ``MjData``. Pickled by
themselves, views would become arrays of their own, which no longer change; joints cannot be pickled
at all.
"""

import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

STRUCTS = "mujoco._structs"
"""The module of MuJoCo's types of which simulations consist."""
OWNERS = ("MjModel", "MjData")
"""The types that MuJoCo can pickle, with all their parts."""
ACCESSOR = re.compile("_Mj(?:Model|Data)(.+)Views")
"""Types of what ``data.joint(name)`` and its like return; the group is the method's name."""

Call = tuple[Callable[..., Any], tuple[Any, ...]]


class Parts:
    """Parts of MuJoCo's models and data, and arrays that are views.

    Parameters
    ----------
    owners : sequence
        The models and data that are copied.
    """

    def __init__(self, owners: Sequence[Any]) -> None:
        self._owners = owners
        self._parts = [
            (owner, name, getattr(owner, name))
            for owner in owners
            for name in dir(owner)
            if not name.startswith("_")
        ]
        self._arrays = [part for *_, part in self._parts if type(part) is np.ndarray]

    def call_for(self, one: object) -> Call | None:
        """Return a function and its arguments that make a part from its owner.

        None for an object that is no part of another.
        """
        if type(one) is not np.ndarray:
            return self._of_owner(one) if type(one).__module__ == STRUCTS else None
        whole = self._whole(one)
        if whole is one:
            return None if one.base is None else self._of_owner(one)
        offset = one.ctypes.data - whole.ctypes.data
        return _view, (whole, one.shape, one.dtype, offset, one.strides)

    def _whole(self, one: np.ndarray) -> np.ndarray:
        """Return the array that an array is a view of; itself if it is none."""
        root = one
        while type(root.base) is np.ndarray:
            root = root.base
        if root.base is not None:
            # Perhaps a simulation's memory: a joint's arrays are views of those of all joints.
            root = next((part for part in self._arrays if np.may_share_memory(part, one)), root)
        # The copy of an array with gaps has none, so that a view would lie elsewhere in it.
        return root if root.flags.forc and not root.dtype.hasobject else one

    def _of_owner(self, one: Any) -> Call | None:
        for owner, name, part in self._parts:
            if part is one:
                return getattr, (owner, name)
        accessor = ACCESSOR.fullmatch(type(one).__name__)
        for owner in self._owners:
            find = getattr(owner, accessor[1].lower(), None) if accessor else None
            if find is not None and find(one.id) is one:
                return _accessed, (owner, find.__name__, one.id)
        return None


def _view(
    whole: np.ndarray,
    shape: tuple[int, ...],
    dtype: np.dtype,
    offset: int,
    strides: tuple[int, ...],
) -> np.ndarray:
    # In the order of the memory, whichever axis comes first.
    return np.ndarray(shape, dtype, whole.ravel(order="K"), offset, strides)


def _accessed(owner: Any, kind: str, number: int) -> object:
    return getattr(owner, kind)(number)
