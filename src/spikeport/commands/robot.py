"""``spikeport robot``: be a robot, in simulation, or listen to one."""

from pydantic import FiniteFloat

from spikeport.commands.ending import ended_in_order
from spikeport.commands.options_of_links import RobotService
from spikeport.commands.process import say
from spikeport.errors import UsageError
from spikeport.key_values import converted, parse
from spikeport.robot.description import JOINTS
from spikeport.robot.link.faults import FAULTS
from spikeport.robot.link.odometer import OdometerErrors
from spikeport.robot.link.place import Place
from spikeport.robot.link.settings import LOCK_STEP_HZ, RobotSettings

TORSO = "torso"
"""The joint that a hoist holds, besides the pelvis."""
REAL_TIME_HZ = 500.0
"""States per second by default, as of Unitree's H1."""


def serve(request: RobotService) -> None:
    """Be a robot until the process is ended, or its controller is gone."""
    place = Place(request.interface, request.domain)
    place.check(request.may_move_a_real_robot)
    if request.fault and not request.lock_step:
        raise UsageError("--fault is for --lock-step: real time has faults of its own")
    if request.priority is not None and request.lock_step:
        raise UsageError("--priority is for real time; lock-step has no deadlines")
    rate_hz = _rate_hz(request)
    faults = [FAULTS._replace(option="--fault").parse(text) for text in request.fault]
    settings = _settings(request, rate_hz)
    from spikeport.robot.link import server  # needs cyclonedds

    service = server.Service(
        place=place,
        robot=settings,
        lock_step=request.lock_step,
        truth=request.truth,
        faults=faults,
        once=request.once,
        idle_s=request.idle,
        priority=request.priority,
    )
    with ended_in_order(serves=True):
        server.serve(service, say)


def listen(interface: str, domain: int, seconds: float) -> None:
    """Print what a robot publishes; see `spikeport.robot.link.listener.listen`."""
    place = Place(interface, domain)
    place.check(may_move_a_robot=True)  # nothing is sent: no robot moves
    from spikeport.robot.link import listener  # needs mujoco

    listener.listen(place, seconds, print)


def _rate_hz(request: RobotService) -> float:
    """Return the states per second; UsageError for a rate that lock-step does not allow."""
    own_hz = LOCK_STEP_HZ if request.lock_step else REAL_TIME_HZ
    rate_hz = own_hz if request.rate_hz is None else request.rate_hz
    if request.lock_step and rate_hz != LOCK_STEP_HZ:
        # A controller has steps of a fixed length, and its time would not be the robot's.
        raise UsageError(
            f"--rate-hz {rate_hz:g} with --lock-step: controllers step at {LOCK_STEP_HZ:g} Hz; "
            "cure: leave it out"
        )
    return rate_hz


def _settings(request: RobotService, rate_hz: float) -> RobotSettings:
    """Return the settings of the robot; UsageError for an unknown joint or odometer error."""
    return RobotSettings(
        rate_hz=rate_hz,
        hoist=request.hoist,
        watchdog_s=request.watchdog_ms / 1000,
        seed=request.seed,
        posture_rad=_posture_rad(request),
        sport_mode=request.sport_mode,
        let_down_s=request.let_down,
        odometer=_odometer(request),
    )


def _odometer(request: RobotService) -> OdometerErrors | None:
    """Return the errors of the odometer; None without one."""
    if request.odometer_error and not request.odometer:
        raise UsageError("--odometer-error is for a robot with an --odometer")
    if not request.odometer:
        return None
    values = parse(request.odometer_error, OdometerErrors, "the odometer", "--odometer-error")
    return OdometerErrors(**{key: float(value) for key, value in values.items()})


def _posture_rad(request: RobotService) -> dict[str, float]:
    """Return the initial angles of the robot's joints."""
    pairs = []
    for text in request.pose:
        joint, _, rad = text.partition("=")
        pairs.append((joint, rad))
    found = converted(pairs, dict.fromkeys(JOINTS, FiniteFloat), "joint", "--pose")
    if request.hoist and TORSO in found:
        raise UsageError(
            f"--pose {TORSO}: a robot on its hoist has its torso at 0; cure: leave it out"
        )
    return {joint: float(rad) for joint, rad in found.items()}
