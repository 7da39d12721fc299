"""Environment descriptions of Isaac Lab's H1 (``env.yaml``), which come with NVIDIA's H1 policies.

They name joints by regular expressions. Observations and actions have the order of Isaac Lab's
articulation: breadth-first, level by level away from the pelvis.
"""

import re
from collections.abc import Iterator, Mapping, Sized
from pathlib import Path

import numpy as np

from spikeport.networks.loading import environment
from spikeport.networks.loading.description import Description
from spikeport.networks.loading.environment import (
    Action,
    Actuator,
    Asset,
    ByName,
    ObservationTerm,
)
from spikeport.reading.mismatch import MismatchError

# Isaac Sim numbers joints breadth first from the pelvis; only the torso has no twin.
_LEVELS = (
    ("hip_yaw", "torso"),
    ("hip_roll", "shoulder_pitch"),
    ("hip_pitch", "shoulder_roll"),
    ("knee", "shoulder_yaw"),
    ("ankle", "elbow"),
)


def _breadth_first() -> Iterator[str]:
    for level in _LEVELS:
        for role in level:
            yield from ("torso",) if role == "torso" else (f"left_{role}", f"right_{role}")


JOINTS = tuple(_breadth_first())
"""The H1's joints, in the order of Isaac Lab's articulation."""

TERMS = {
    "base_lin_vel": 3,
    "base_ang_vel": 3,
    "projected_gravity": 3,
    "generated_commands": 3,
    "joint_pos_rel": len(JOINTS),
    "joint_vel_rel": len(JOINTS),
    "last_action": len(JOINTS),
}
"""Functions of the observation's terms in their order, and the terms' sizes."""

ALL = (None, [None] * 3, list(range(len(JOINTS))))
"""Numbers that choose all joints in their order; three times none is a slice of all."""

ACTION = "JointPositionAction"

MAX_ITEMS = 100
"""The most items of a table, of a list of expressions, and of groups: there are 19 joints."""

MOST = {"*+?": 2, "(": 2, "|": 10}
"""The most of these characters in an expression: each one multiplies the ways to match it."""

SIMPLE = re.compile(r"(?:[\w.|(\[\]^$-]|\\[.wd]|\)(?![*+?])|(?<!\()[*+?]){1,100}")
"""Expressions for names as in Isaac Lab; repeated groups with repeats could take for ever."""


def described(path: Path) -> Description:
    """Return the robot and the observation of a policy.

    Raises
    ------
    MismatchError
        The file describes another robot, another observation or another kind of action.
    """
    found, terms = environment.read(path)
    action, robot = _action(found.actions), found.scene.robot
    return Description(
        joints=JOINTS,
        pose_rad=_of_joints("robot.init_state.joint_pos", robot.init_state.joint_pos, 0.0),
        gains=_gains(robot.actuators),
        action_scale_rad=_of_joints("actions: scale", action.scale, 1.0),
        control_dt_s=found.decimation * found.sim.dt,
        observation_scale=_scales(terms),
    )


def _action(actions: Mapping[str, Action]) -> Action:
    # `module:Name`: the module differs between major versions of Isaac Lab.
    kinds = [action.class_type.rpartition(":")[2] for action in actions.values()]
    if kinds != [ACTION]:
        raise MismatchError(f"one action, a {ACTION}", ", ".join(kinds) or "none")
    (action,) = actions.values()
    if len(_matching("actions: joint_names", action.joint_names)) != len(JOINTS):
        raise MismatchError("an action for every joint", ", ".join(action.joint_names))
    return action


def _scales(terms: Mapping[str, ObservationTerm]) -> np.ndarray:
    functions = [term.func.rpartition(":")[2] for term in terms.values()]
    if functions != list(TERMS):
        raise MismatchError(f"the observation {', '.join(TERMS)}", ", ".join(functions) or "none")
    for name, term in terms.items():
        _check_joints(f"observations.policy.{name}", term.params.asset_cfg)
    scales = [1.0 if term.scale is None else term.scale for term in terms.values()]
    return np.repeat(scales, list(TERMS.values()))


def _check_joints(where: str, asset: Asset) -> None:
    """Refuse joints of a term that are not all of them, in the order of the articulation."""
    names, found = asset.joint_names, list(JOINTS)
    if names is not None:
        names = [names] if isinstance(names, str) else names
        found = _matching(where, names)
        if asset.preserve_order:
            found = [joint for one in names for joint in _matching(where, [one])]
    if found != list(JOINTS) or asset.joint_ids not in ALL:
        raise MismatchError(
            f"all joints in {where}, in the order of Isaac Lab's articulation", "others"
        )


def _gains(actuators: Mapping[str, Actuator]) -> dict[str, tuple[float, float]]:
    gains = {}
    _few("actuators", actuators)
    for name, group in actuators.items():
        where = f"actuators.{name}"
        for joint in _matching(f"{where}.joint_names_expr", group.joint_names_expr):
            stiffness, damping = (
                _value(where, joint, table, np.nan) for table in (group.stiffness, group.damping)
            )
            if joint in gains:
                raise MismatchError(f"{joint} in one group of actuators", f"it in {where}, too")
            gains[joint] = (stiffness, damping)
    for joint in JOINTS:
        if not np.isfinite(gains.get(joint, np.nan)).all():
            raise MismatchError(f"stiffness and damping of {joint}", "none")
    return gains


def _of_joints(where: str, table: ByName, default: float) -> dict[str, float]:
    if isinstance(table, dict):
        _matching(where, list(table))
    return {joint: _value(where, joint, table, default) for joint in JOINTS}


def _value(where: str, joint: str, table: ByName, default: float) -> float:
    """Return a joint's value in a table; at most one expression may match."""
    if not isinstance(table, dict):
        return table
    _few(where, table)
    found = [value for expression, value in table.items() if _matches(expression, joint)]
    # Isaac Lab refuses such a table, too: the value would depend on the order of expressions.
    if len(found) > 1:
        raise MismatchError(f"one value of {joint} in {where}", f"{len(found)}")
    return found[0] if found else default


def _matching(where: str, expressions: list[str]) -> list[str]:
    """Return the joints that expressions match; each expression has to match a joint."""
    _few(where, expressions)
    for expression in expressions:
        # As in Isaac Lab: an expression that no joint matches is a misspelt name.
        if not any(_matches(expression, joint) for joint in JOINTS):
            raise MismatchError(f"joints of the H1 in {where}", expression)
    return [j for j in JOINTS if any(_matches(e, j) for e in expressions)]


def _matches(expression: str, joint: str) -> bool:
    """Return whether a joint's name matches; raise MismatchError if matching may not end."""
    many = any(sum(map(expression.count, letters)) > most for letters, most in MOST.items())
    if many or not SIMPLE.fullmatch(expression):
        raise MismatchError("simple regular expressions for names of joints", expression)
    try:
        return re.fullmatch(expression, joint) is not None
    except re.error as error:
        raise MismatchError("a regular expression", f"{expression} ({error})") from None


def _few(where: str, items: Sized) -> None:
    if len(items) > MAX_ITEMS:
        raise MismatchError(f"at most {MAX_ITEMS} items in {where}", f"{len(items):,}")
