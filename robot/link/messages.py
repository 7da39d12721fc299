"""Unitree's messages for the H1 (``unitree_go``), as plain declarations.

Layouts on the wire (`spikeport.robot.link.wire`) and DDS types (`spikeport.robot.link.idl`) are
made from them. Names, order and types of fields are part of a type's hash, by which DDS compares
the types of two sides.

Source: unitree_sdk2, ``include/unitree/idl/go2``; the order of fields was checked by the hashes.
"""

from collections.abc import Iterator
from typing import NamedTuple

N_SLOTS = 20
"""Motor slots of a message; the H1 uses 19 of them."""
# Low-level messages begin with these in Unitree's SDK.
HEAD = (0xFE, 0xEF)
LEVEL_FLAG = 0xFF


class Field(NamedTuple):
    """A field: its name, its type or struct, and its length if it is an array, else 0.

    A type is a NumPy code, or ``bool``, ``text`` or ``bytes``, which `Layout` does not support.
    """

    name: str
    kind: "str | Struct"
    length: int = 0


class Struct(NamedTuple):
    """A struct: its name, its fields, and the Unitree package with it in ``msg.dds_``."""

    name: str
    fields: tuple[Field, ...]
    package: str = "unitree_go"

    def leaves(self, prefix: str = "") -> Iterator[tuple[str, str, int]]:
        """Yield path, type and length of all fields that are not structs, in order."""
        for name, kind, length in self.fields:
            if isinstance(kind, str):
                yield f"{prefix}{name}", kind, max(length, 1)
            elif length:
                for number in range(length):
                    yield from kind.leaves(f"{prefix}{name}[{number}].")
            else:
                yield from kind.leaves(f"{prefix}{name}.")


_FRAME = (
    Field("head", "u1", 2),
    Field("level_flag", "u1"),
    Field("frame_reserve", "u1"),
    Field("sn", "u4", 2),
    Field("version", "u4", 2),
    Field("bandwidth", "u2"),
)
_MOTOR_CMD = Struct(
    "MotorCmd_",
    (
        Field("mode", "u1"),
        *(Field(name, "f4") for name in ("q", "dq", "tau", "kp", "kd")),
        Field("reserve", "u4", 3),
    ),
)
_BMS_CMD = Struct("BmsCmd_", (Field("off", "u1"), Field("reserve", "u1", 3)))

LOW_CMD = Struct(
    "LowCmd_",
    (
        *_FRAME,
        Field("motor_cmd", _MOTOR_CMD, N_SLOTS),
        Field("bms_cmd", _BMS_CMD),
        Field("wireless_remote", "u1", 40),
        Field("led", "u1", 12),
        Field("fan", "u1", 2),
        Field("gpio", "u1"),
        Field("reserve", "u4"),
        Field("crc", "u4"),
    ),
)
"""The command of all motors, topic ``rt/lowcmd``."""

_IMU_STATE = Struct(
    "IMUState_",
    (
        Field("quaternion", "f4", 4),
        Field("gyroscope", "f4", 3),
        Field("accelerometer", "f4", 3),
        Field("rpy", "f4", 3),
        Field("temperature", "u1"),
    ),
)
_MOTOR_STATE = Struct(
    "MotorState_",
    (
        Field("mode", "u1"),
        *(Field(name, "f4") for name in ("q", "dq", "ddq", "tau_est", "q_raw", "dq_raw")),
        Field("ddq_raw", "f4"),
        Field("temperature", "u1"),
        Field("lost", "u4"),
        Field("reserve", "u4", 2),
    ),
)
_BMS_STATE = Struct(
    "BmsState_",
    (
        *(Field(name, "u1") for name in ("version_high", "version_low", "status", "soc")),
        Field("current", "i4"),
        Field("cycle", "u2"),
        Field("bq_ntc", "u1", 2),
        Field("mcu_ntc", "u1", 2),
        Field("cell_vol", "u2", 15),
    ),
)

LOW_STATE = Struct(
    "LowState_",
    (
        *_FRAME,
        Field("imu_state", _IMU_STATE),
        Field("motor_state", _MOTOR_STATE, N_SLOTS),
        Field("bms_state", _BMS_STATE),
        Field("foot_force", "i2", 4),
        Field("foot_force_est", "i2", 4),
        Field("tick", "u4"),
        Field("wireless_remote", "u1", 40),
        Field("bit_flag", "u1"),
        Field("adc_reel", "f4"),
        Field("temperature_ntc1", "u1"),
        Field("temperature_ntc2", "u1"),
        Field("power_v", "f4"),
        Field("power_a", "f4"),
        Field("fan_frequency", "u2", 4),
        Field("reserve", "u4"),
        Field("crc", "u4"),
    ),
)
"""The observation of all sensors, topic ``rt/lowstate``."""

_TIME_SPEC = Struct("TimeSpec_", (Field("sec", "i4"), Field("nanosec", "u4")))
_PATH_POINT = Struct(
    "PathPoint_",
    tuple(Field(name, "f4") for name in ("t_from_start", "x", "y", "yaw", "vx", "vy", "vyaw")),
)

SPORT_MODE_STATE = Struct(
    "SportModeState_",
    (
        Field("stamp", _TIME_SPEC),
        Field("error_code", "u4"),
        Field("imu_state", _IMU_STATE),
        Field("mode", "u1"),
        Field("progress", "f4"),
        Field("gait_type", "u1"),
        Field("foot_raise_height", "f4"),
        Field("position", "f4", 3),
        Field("body_height", "f4"),
        Field("velocity", "f4", 3),
        Field("yaw_speed", "f4"),
        Field("range_obstacle", "f4", 4),
        Field("foot_force", "i2", 4),
        Field("foot_position_body", "f4", 12),
        Field("foot_speed_body", "f4", 12),
        Field("path_point", _PATH_POINT, 10),
    ),
)
"""Place and velocity of the base, topics ``rt/sportmodestate`` and ``rt/odommodestate``."""

_API = "unitree_api"
_IDENTITY = Struct("RequestIdentity_", (Field("id", "i8"), Field("api_id", "i8")), _API)
_LEASE = Struct("RequestLease_", (Field("id", "i8"),), _API)
_POLICY = Struct("RequestPolicy_", (Field("priority", "i4"), Field("noreply", "bool")), _API)
_STATUS = Struct("ResponseStatus_", (Field("code", "i4"),), _API)

REQUEST = Struct(
    "Request_",
    (
        Field(
            "header",
            Struct(
                "RequestHeader_",
                (Field("identity", _IDENTITY), Field("lease", _LEASE), Field("policy", _POLICY)),
                _API,
            ),
        ),
        Field("parameter", "text"),
        Field("binary", "bytes"),
    ),
    _API,
)
"""A request of one of the robot's services, topic ``rt/api/SERVICE/request``."""

RESPONSE = Struct(
    "Response_",
    (
        Field(
            "header",
            Struct(
                "ResponseHeader_",
                (Field("identity", _IDENTITY), Field("status", _STATUS)),
                _API,
            ),
        ),
        Field("data", "text"),
        Field("binary", "bytes"),
    ),
    _API,
)
"""The answer to a request, topic ``rt/api/SERVICE/response``."""


class Topic(NamedTuple):
    """A topic: its name, and the message on it."""

    name: str
    message: Struct


COMMANDS = Topic("rt/lowcmd", LOW_CMD)
STATES = Topic("rt/lowstate", LOW_STATE)
TRUTHS = Topic("rt/sportmodestate", SPORT_MODE_STATE)
ODOMETRY = Topic("rt/odommodestate", SPORT_MODE_STATE)
SWITCHER_REQUESTS = Topic("rt/api/motion_switcher/request", REQUEST)
SWITCHER_RESPONSES = Topic("rt/api/motion_switcher/response", RESPONSE)
