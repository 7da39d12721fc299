"""Declarations of Unitree's messages: their fields, the paths to these, and the topics."""

from spikeport.robot.link.messages import COMMANDS, LOW_CMD, LOW_STATE, STATES, TRUTHS


def test_paths_of_fields_lead_through_structs_and_arrays_of_structs() -> None:
    leaves = list(LOW_CMD.leaves())
    assert leaves[0] == ("head", "u1", 2)
    assert ("motor_cmd[19].kp", "f4", 1) in leaves
    assert leaves[-1] == ("crc", "u4", 1)
    assert len(leaves) == 6 + 20 * 7 + 2 + 6
    assert ("imu_state.quaternion", "f4", 4) in list(LOW_STATE.leaves())


def test_topics_have_unitrees_names() -> None:
    assert [topic.name for topic in (COMMANDS, STATES, TRUTHS)] == [
        *("rt/lowcmd", "rt/lowstate", "rt/sportmodestate"),
    ]
