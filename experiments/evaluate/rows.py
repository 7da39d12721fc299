"""The rows of a robustness table: the perturbation of the robot in each."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import fields

from spikeport import key_values
from spikeport.errors import UsageError
from spikeport.key_values import SettingValue
from spikeport.robot.perturbation import Perturbation

Row = Mapping[str, SettingValue]
"""Settings of a `Perturbation`; without any, it is the robot that controllers are made for."""

NOMINAL: Row = {}
MENAGERIE: Row = {"robot_model": "menagerie"}

ROWS: tuple[Row, ...] = (
    NOMINAL,
    *({"friction": value} for value in (0.2, 0.4, 1.5)),
    *({"mass": value} for value in (0.9, 1.1, 1.2)),
    *({"payload": value} for value in (5.0, 10.0)),
    *({"com_x": value} for value in (-0.05, 0.05)),
    {"com_y": 0.03},
    *({"gains": value} for value in (0.8, 1.2)),
    *({"strength": value} for value in (0.7, 0.5)),
    *({"action_delay": value} for value in (0.01, 0.02, 0.03)),
    *({"observation_delay": value} for value in (0.01, 0.02, 0.03)),
    *({"sensor_noise": value} for value in (0.5, 1.0)),
    *({"push": value} for value in (0.4, 0.8, 1.0)),
    *({"terrain": value} for value in ("slope:3", "slope:6", "slope:-6", "slope:6:90")),
    *({"terrain": value} for value in ("boxes:0.01", "boxes:0.02")),
    *({"terrain": value} for value in ("relief:0.01", "relief:0.02", "relief:0.03")),
    *({"estimator": value} for value in ("leg-odometry", "ekf")),
    {"sensor_noise": 1.0, "estimator": "ekf"},
    {"robot_model": "urdf"},
    {
        "robot_model": "urdf",
        "observation_delay": 0.02,
        "sensor_noise": 0.5,
        "push": 0.4,
        "terrain": "boxes:0.01",
    },
)
"""The default rows of the table; with MENAGERIE_ROOT, one with Menagerie's feet is added."""


def name_of(row: Row) -> str:
    """Return the name of a row."""
    return " ".join(f"{key}={value}" for key, value in row.items()) or "nominal"


def find_rows(asked: Sequence[str]) -> tuple[Row, ...]:
    """Return the nominal row and a row for each ``KEY=VALUE,KEY=VALUE``; without texts, `ROWS`.

    Raises
    ------
    UsageError
        If a key or value does not belong to a perturbation, or a row is asked for twice.
    """
    if not asked:
        return (*ROWS, MENAGERIE) if os.environ.get("MENAGERIE_ROOT") else ROWS
    rows = (NOMINAL, *(_parsed(text) for text in asked))
    names = [name_of(row) for row in rows]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise UsageError(f"--row {twice}: listed twice; cure: leave one out")
    return rows


def _parsed(text: str) -> Row:
    pairs = text.split(",")
    for pair in pairs:
        if "=" not in pair:
            raise UsageError(f"--row {text}: expected KEY=VALUE,KEY=VALUE, found '{pair}'")
    row = key_values.parse(pairs, Perturbation, "a perturbation", option="--row")
    Perturbation(**row)
    changed = _changed(row)
    if not changed:
        raise UsageError(
            f"--row {text}: perturbs nothing, and the row 'nominal' is always there; cure: leave "
            "it out"
        )
    if "push_every" in changed and not changed.get("push"):
        raise UsageError(
            f"--row {text}: push_every is the time between pushes, and there are none; cure: "
            "push=0.8 beside it, or leave it out"
        )
    return changed


def _changed(row: Row) -> Row:
    """Return a row in the order of fields and without defaults: equal rows have equal names."""
    return {
        one.name: row[one.name]
        for one in fields(Perturbation)
        if row.get(one.name, one.default) != one.default
    }
