"""A user's own path: a CSV file with columns ``t_s,x_m,y_m`` and a row for each moment."""

import math
from pathlib import Path

import numpy as np

from spikeport.errors import UsageError
from spikeport.reading.mismatch import MismatchError, shown
from spikeport.reading.text import read_text

ENDING = ".csv"
COLUMNS = "t_s,x_m,y_m"
FASTEST_M_S = 1.0
FASTEST_RAD_S = 1.0
"""The largest speed and yaw rate that the walking policy is trained for."""
FARTHEST_START_M = 0.5
"""The largest distance from the robot to the beginning of a path."""
LONGEST_M = 10_000.0
"""The longest path: it becomes points that are close together, and walking it takes hours."""
LARGEST = 1e10
"""The largest number: seconds may be counted from 1970; larger ones overflow later."""
TURN_S = 4.0
"""Turns are checked over this time, in which a robot can turn back, or turn a corner."""
ROUNDING = 1e-6
TABLE_BYTES = 2**22
"""The largest file: a row for every millisecond of two minutes."""


def path_files(name: str) -> list[Path]:
    """Return the file of a path, or no file for the name of a built-in path."""
    return [Path(name)] if name.endswith(ENDING) else []


def read_path(file: Path, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Read times (n,) in s and points (n, 2) in m of a path that lasts for some seconds.

    Raises
    ------
    UsageError
        If the file is not such a table, or the robot cannot follow its path for so long.
    """
    table = _read_table(file)
    # Times count from the first row, whatever clock wrote them.
    time_s, points = table[:, 0] - table[0, 0], table[:, 1:]
    _check_start(file, points[0])
    _check_speed(file, time_s, points)
    _check_turns(file, time_s, points)
    if time_s[-1] < seconds - ROUNDING:
        raise UsageError(
            f"path '{file}': lasts {time_s[-1]:g} s, but {seconds:g} s are needed, including the "
            "lead of the reference; cure: fewer --seconds, or a longer path"
        )
    return time_s, points


def _read_table(file: Path) -> np.ndarray:
    """Return the rows of a file, (n, 3), whose times rise."""
    try:
        text = read_text(file, TABLE_BYTES)
    except MismatchError as error:
        raise UsageError(f"path '{file}': {error}; cure: write a table as CSV in UTF-8") from None
    header, *rows = text.splitlines() or [""]
    if header.replace(" ", "") != COLUMNS:
        raise _no_table(file, f"columns '{header}'")
    cells = {line: row.split(",") for line, row in enumerate(rows, 2) if row.strip()}
    if len(cells) < 2:
        raise _no_table(file, f"{len(cells)} row{'' if cells else 's'}")
    for line, row in cells.items():
        if len(row) != 3:
            raise _no_row(file, line, f"{len(row)} cells, expected 3")
    table = np.array([[_number(cell) for cell in row] for row in cells.values()])
    _check_numbers(file, cells, table)
    _check_times(file, cells, table[:, 0])
    return table


def _number(cell: str) -> float:
    """Return the decimal number in a cell; NaN if there is none."""
    # Python also reads 1_0, and digits of all scripts.
    if "_" in cell or not cell.isascii():
        return math.nan
    try:
        return float(cell)
    except ValueError:
        return math.nan


def _check_numbers(file: Path, cells: dict[int, list[str]], table: np.ndarray) -> None:
    wrong = np.argwhere(~(np.abs(table) <= LARGEST))
    if wrong.size:
        row, column = wrong[0]
        line, name = list(cells)[row], COLUMNS.split(",")[column]
        rule = f"a decimal number from {-LARGEST:g} to {LARGEST:g}"
        raise _no_row(file, line, f"{name} '{cells[line][column].strip()}' is not {rule}")


def _check_times(file: Path, cells: dict[int, list[str]], time_s: np.ndarray) -> None:
    held = np.flatnonzero(np.diff(time_s) <= 0)
    if held.size:
        before, line = list(cells)[held[0] : held[0] + 2]
        earlier, time = (cells[one][0].strip() for one in (before, line))
        raise _no_row(file, line, f"time {time} does not follow {earlier}")


def _no_row(file: Path, line: int, fault: str) -> UsageError:
    return UsageError(f"path '{file}': line {line}: {shown(fault)}; cure: correct the line")


def _no_table(file: Path, found: str) -> UsageError:
    return UsageError(
        f"path '{file}': expected columns '{COLUMNS}' and two rows or more, found {shown(found)}; "
        "cure: write such a table"
    )


def _check_start(file: Path, start: np.ndarray) -> None:
    gap_m = float(np.linalg.norm(start))
    if gap_m > FARTHEST_START_M:
        raise UsageError(
            f"path '{file}': begins with a jump of {gap_m:.2f} m, from the robot at (0, 0) to "
            f"({start[0]:g}, {start[1]:g}), limit {FARTHEST_START_M:g} m; cure: begin at the robot"
        )


def _check_speed(file: Path, time_s: np.ndarray, points: np.ndarray) -> None:
    moved_m = np.linalg.norm(np.diff(points, axis=0), axis=1)
    speed_m_s = moved_m / np.diff(time_s)
    if moved_m.sum() > LONGEST_M:
        raise UsageError(
            f"path '{file}': is {moved_m.sum():,.0f} m long, limit {LONGEST_M:,.0f} m; cure: a "
            "shorter path"
        )
    worst = int(np.argmax(speed_m_s))
    if speed_m_s[worst] > FASTEST_M_S * (1 + ROUNDING):
        raise UsageError(
            f"path '{file}': moves {moved_m[worst]:.2f} m from {time_s[worst]:g} to "
            f"{time_s[worst + 1]:g} s, {speed_m_s[worst]:.2f} m/s, limit {FASTEST_M_S:g} m/s, for "
            "which the policy is trained; cure: more time for this part"
        )


def _check_turns(file: Path, time_s: np.ndarray, points: np.ndarray) -> None:
    """Refuse a path that keeps turning faster than the robot can; a single corner is allowed."""
    steps = np.diff(points, axis=0)
    moves = np.linalg.norm(steps, axis=1) > 0
    if not moves.any():
        return
    # Pieces without motion have no heading. Unwrapped, turns beyond pi add up.
    begun_s, heading = time_s[:-1][moves], np.unwrap(np.arctan2(*steps[moves].T[::-1]))
    # For each piece, the end of the pieces that begin within `TURN_S` from there.
    end = np.searchsorted(begun_s, begun_s + TURN_S * (1 - ROUNDING), side="right")
    # A left turn may follow a right turn, so comparing the ends of the time is not enough.
    turned = _extremes(heading, end, np.maximum) - _extremes(heading, end, np.minimum)
    worst, limit = int(np.argmax(turned)), FASTEST_RAD_S * TURN_S
    if turned[worst] > limit:
        within = heading[worst : end[worst]]
        first, last = worst + np.sort((int(within.argmin()), int(within.argmax())))
        raise UsageError(
            f"path '{file}': turns by {turned[worst]:.2f} rad from {begun_s[first]:g} to "
            f"{begun_s[last]:g} s, limit {limit:g} rad in {TURN_S:g} s, {FASTEST_RAD_S:g} "
            "rad/s, for which the policy is trained; cure: more time for this part, or wider turns"
        )


def _extremes(values: np.ndarray, end: np.ndarray, larger: np.ufunc) -> np.ndarray:
    """Return the extreme of ``values[i:end[i]]`` for each i, by stretches of 2^k values."""
    first = np.arange(len(values))
    # Two stretches of the largest power of two that fits cover each range.
    power = np.log2(end - first).astype(int)
    found, stretch = np.empty_like(values), values
    for k in range(power.max() + 1):
        here = power == k
        found[here] = larger(stretch[first[here]], stretch[end[here] - 2**k])
        stretch = larger(stretch[: -(2**k)], stretch[2**k :])
    return found
