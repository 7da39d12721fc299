"""A recording of a run in closed loop: columns with a row for each step of the plant."""

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

import numpy as np


@dataclass(frozen=True)
class Recording:
    """Columns of a run, with a row for each step of the plant; ports add their own columns.

    Attributes
    ----------
    time_s : (n,) array
        Simulated time, in s.
    """

    time_s: np.ndarray

    @classmethod
    def of(cls, rows: Iterable[tuple[object, ...]]) -> Self:
        """Make a recording of rows, each with a value for every column."""
        return cls(*(np.array(column) for column in zip(*rows, strict=True)))

    @classmethod
    def join(cls, recordings: Iterable[Self]) -> Self:
        """Concatenate recordings."""
        columns = zip(*(recording.columns for recording in recordings), strict=True)
        return cls(*(np.concatenate(column) for column in columns))

    @property
    def columns(self) -> tuple[np.ndarray, ...]:
        """The columns, each with n rows."""
        return tuple(getattr(self, field.name) for field in dataclasses.fields(self))

    def where(self, chosen: np.ndarray) -> Self:
        """Return the rows that are chosen by an (n,) array of bool."""
        return type(self)(*(column[chosen] for column in self.columns))
