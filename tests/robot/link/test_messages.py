"""Declarations of Unitree's messages: their fields, the paths to these, and the topics."""

from spikeport.robot.link.messages import (
    COMMANDS,
    LOW_CMD,
    LOW_STATE,
    ODOMETRY,
    STATES,
    SWITCHER_REQUESTS,
    SWITCHER_RESPONSES,
    TRUTHS,
)


def test_paths_of_fields_lead_through_structs_and_arrays_of_structs() -> None:
    leaves = list(LOW_CMD.leaves())
    assert leaves[0] == ("head", "u1", 2)
    assert ("motor_cmd[19].kp", "f4", 1) in leaves
    assert leaves[-1] == ("crc", "u4", 1)
    assert len(leaves) == 6 + 20 * 7 + 2 + 6
    assert ("imu_state.quaternion", "f4", 4) in list(LOW_STATE.leaves())


def test_topics_have_unitrees_names() -> None:
    topics = (COMMANDS, STATES, TRUTHS, ODOMETRY, SWITCHER_REQUESTS, SWITCHER_RESPONSES)
    assert [topic.name for topic in topics] == [
        *("rt/lowcmd", "rt/lowstate", "rt/sportmodestate", "rt/odommodestate"),
        *("rt/api/motion_switcher/request", "rt/api/motion_switcher/response"),
    ]
