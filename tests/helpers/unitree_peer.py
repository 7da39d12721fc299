"""Either end of a robot's interface by Unitree's C++ SDK; run by a Python that has far-unitree-sdk.

``controller`` commands a robot and prints its last observation, ``robot`` publishes states,
answers as a motion switcher, and prints the last command that it received, as JSON.
"""

import json
import sys
import time

import unitree_interface as unitree

LOOPBACK = (
    '<CycloneDDS><Domain Id="any"><General><Interfaces><NetworkInterface name="lo" '
    'multicast="false"/></Interfaces><AllowMulticast>false</AllowMulticast></General><Discovery>'
    '<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers>'
    "</Discovery></Domain></CycloneDDS>"
)
SLOTS = 20
RAMP = [slot / 64 for slot in range(SLOTS)]


def controller(end: "unitree.UnitreeInterface", seconds: float) -> dict[str, object]:
    """Drive all motors to a ramp, gently."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        command = unitree.MotorCommand(SLOTS)
        command.q_target, command.dq_target = RAMP, [0.0] * SLOTS
        command.kp, command.kd = [100.0] * SLOTS, [5.0] * SLOTS
        command.tau_ff = [0.5] * SLOTS
        end.write_low_command(command)
        time.sleep(0.01)
    state = end.read_low_state()
    return {"q": list(state.motor.q), "quaternion": list(state.imu.quat)}


def robot(end: "unitree.UnitreeInterface", seconds: float) -> dict[str, object]:
    """Publish a ramp of angles, and answer as a motion switcher."""
    end.enable_motion_switcher_responder()
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        state = unitree.LowState(SLOTS)
        state.motor.q = RAMP
        state.imu.quat, state.imu.accel = [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 9.75]
        end.publish_low_state(state)
        time.sleep(0.01)
    command = end.read_incoming_command()
    names = {"q": "q_target", "dq": "dq_target", "kp": "kp", "kd": "kd", "tau": "tau_ff"}
    return {name: list(getattr(command, theirs)) for name, theirs in names.items()}


if __name__ == "__main__":
    made = unitree.UnitreeInterface.create_custom(
        "lo", SLOTS, unitree.MessageType.GO2, dds_config=LOOPBACK
    )
    found = {"controller": controller, "robot": robot}[sys.argv[1]](made, float(sys.argv[2]))
    print(json.dumps(found), flush=True)
