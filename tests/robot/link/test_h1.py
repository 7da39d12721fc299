"""The H1 in Unitree's messages: slots, limits, refusals."""

import numpy as np
import pytest

from spikeport.robot.description import JOINTS, load
from spikeport.robot.link.h1 import (
    DAMPING,
    MODES,
    SLOTS,
    SPEED_LIMITS_RAD_S,
    TORQUE_LIMITS_NM,
    check_commands,
)
from spikeport.robot.link.wire import MessageError


def test_every_joint_has_a_slot_and_slot_9_has_no_joint() -> None:
    assert sorted(SLOTS) == [slot for slot in range(20) if slot != 9]
    slot = dict(zip(JOINTS, SLOTS, strict=True))
    assert [slot[f"right_{role}"] for role in ("hip_roll", "hip_pitch", "knee")] == [0, 1, 2]
    assert (slot["torso"], slot["left_hip_yaw"], slot["right_hip_yaw"]) == (6, 7, 8)
    assert (slot["left_ankle"], slot["right_elbow"], slot["left_shoulder_pitch"]) == (10, 15, 16)


def test_weak_motors_have_a_mode_of_their_own() -> None:
    weak = {joint for joint, slot in zip(JOINTS, SLOTS, strict=True) if MODES[slot] == 1}
    assert weak == {j for j in JOINTS if "ankle" in j or "shoulder" in j or "elbow" in j}


def test_torque_limits_are_those_of_the_model() -> None:
    model = load()
    np.testing.assert_array_equal(model.actuator_forcerange[:, 1], TORQUE_LIMITS_NM)


@pytest.mark.parametrize(
    ("name", "value", "kp", "kd", "words"),
    [
        ("q", np.nan, 0.0, 0.0, "q of torso is nan"),
        ("q", 6.4, 1.0, 0.0, "q of torso is 6.4, allowed -6.28319 to 6.28319"),
        ("dq", 24.0, 0.0, 1.0, "dq of torso is 24, allowed -23 to 23"),
        ("kp", -1.0, 0.0, 0.0, "kp of torso is -1, allowed 0 to 1e"),
        ("kp", 1e39, 0.0, 0.0, "kp of torso is 1e"),
        ("q", 1e39, 0.0, 0.0, "q of torso is 1e"),
        ("kd", np.inf, 0.0, 0.0, "kd of torso is inf"),
        ("tau", -201.0, 0.0, 0.0, "tau of torso is -201, allowed -200 to 200"),
    ],
)
def test_a_command_beyond_the_limits_is_refused_with_joint_and_value(
    name: str, value: float, kp: float, kd: float, words: str
) -> None:
    one = np.zeros(len(JOINTS))
    one[JOINTS.index("torso")] = 1.0
    commands = DAMPING._replace(kp=kp * one, kd=kd * one)
    commands = commands._replace(**{name: value * one if np.isfinite(value) else one})
    if not np.isfinite(value):
        getattr(commands, name)[JOINTS.index("torso")] = value
    with pytest.raises(MessageError, match=words):
        check_commands(commands)


def test_targets_with_a_gain_of_zero_are_not_limited() -> None:
    nowhere = np.full(len(JOINTS), 2.146e9)  # Unitree's "no target"
    check_commands(DAMPING._replace(q=nowhere))
    check_commands(DAMPING._replace(dq=np.full(len(JOINTS), 16000.0), kd=np.zeros(len(JOINTS))))


def test_commands_at_the_limits_are_allowed_despite_rounding_to_float32() -> None:
    check_commands(DAMPING._replace(dq=SPEED_LIMITS_RAD_S, tau=TORQUE_LIMITS_NM))
    check_commands(DAMPING._replace(tau=TORQUE_LIMITS_NM * (1 + 1e-7)))
