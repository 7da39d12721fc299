"""Errors of the estimators of the robot's motion, on the figure-eight walked by the exact policy.

    OPENBLAS_NUM_THREADS=1 python benchmarks/estimators.py [--seconds 40] [--seeds 3] [--into FILE]

In an open loop, the controllers observe the truth, and the estimator only runs along. In a closed
loop, all controllers, including the path follower, only observe the estimate. Errors are rms over
all seeds, up to a fall and without the first second; the distance from the path is over the whole
walk. Drift is the error at the end, for the worst seed.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import markdown_table
import numpy as np
from arguments import at_least

from spikeport.angles import wrap
from spikeport.experiments.walk.legs import PolicyView
from spikeport.experiments.walk.paths import WalkPath, find_path
from spikeport.experiments.walk.port import LEAD_S
from spikeport.experiments.walk.recording import fallen
from spikeport.networks.path_following import exact_command
from spikeport.networks.walking_policy import load
from spikeport.robot.description import JOINTS
from spikeport.robot.estimator import torso
from spikeport.robot.estimator.base import Fix, StateEstimator
from spikeport.robot.estimator.contact_aided_ekf import ContactAidedEkf, EkfNoise
from spikeport.robot.estimator.leg_odometry import LegOdometry
from spikeport.robot.estimator.simulated_sensors import (
    EXACT,
    ROUGH,
    SensorErrors,
    SimulatedSensors,
)
from spikeport.robot.estimator.truth import Truth
from spikeport.robot.plant import Plant
from spikeport.robot.state import RobotState, in_plane
from spikeport.robot.walk_interface import CONTROL_DT_S, targets_rad

SETTLING_S = 1.0
FIX_DT_S, FIX_NOISE_M = 0.02, 0.005
"""Motion capture, in cases that have it: time between fixes, and their noise."""

ESTIMATORS: dict[str, Callable[[Plant], StateEstimator]] = {
    "truth": lambda plant: Truth(lambda: plant.state),
    "leg odometry": lambda _: LegOdometry(),
    "contact-aided EKF": lambda _: ContactAidedEkf(),
    "EKF, floor not level": lambda _: ContactAidedEkf(replace(EkfNoise(), floor_m=None)),
}


@dataclass(frozen=True)
class Case:
    """One way to walk: estimator, loop, errors of the sensors, floor, motion capture."""

    estimator: str
    closed: bool
    sensors: SensorErrors = EXACT
    friction: float = 1.0
    mocap: bool = False
    dt_s: float = 0.005

    @property
    def name(self) -> str:
        """The case's cell in the table, without the estimator."""
        parts = ["closed" if self.closed else "open"]
        parts += ["rough sensors"] * (self.sensors == ROUGH)
        parts += [f"friction {self.friction:g}"] * (self.friction != 1)
        parts += ["motion capture"] * self.mocap
        parts += [f"{1 / self.dt_s:.0f} Hz"] * (self.dt_s != 0.005)
        return ", ".join(parts)


TRUTH, LEGS, EKF, UNEVEN = ESTIMATORS
CASES = (
    Case(TRUTH, closed=True),
    *(Case(name, closed=closed) for name in (LEGS, EKF, UNEVEN) for closed in (False, True)),
    *(Case(name, closed=True, sensors=ROUGH) for name in (LEGS, EKF)),
    *(Case(name, closed=True, sensors=ROUGH, mocap=True) for name in (LEGS, EKF)),
    *(Case(name, closed=True, friction=0.4) for name in (TRUTH, LEGS, EKF)),
    *(Case(name, closed=True, dt_s=0.002) for name in (TRUTH, LEGS, EKF)),
)
HEADS = (
    *("estimator", "loop", "velocity x, y, z, m/s", "tilt, mrad", "yaw drift, mrad"),
    *("place drift, m", "off the path, m", "falls", "us an update"),
)


class Walk(NamedTuple):
    """A walk: true and estimated motion at each physics step, CPU time of an update, and a fall."""

    path: WalkPath
    true: list[RobotState]
    estimated: list[RobotState]
    update_s: float
    fell: bool


class Controllers:
    """The exact path follower and the exact policy, in closed loop with a state."""

    def __init__(self, path: WalkPath, steps: int) -> None:
        self._path, self._steps = path, steps
        self._view, self._policy = PolicyView(CONTROL_DT_S), load()
        self._action, self._step = np.zeros(len(JOINTS)), 0

    def targets_rad(self, state: RobotState, time_s: float) -> np.ndarray:
        """Return the joint targets; the policy acts every 20 ms."""
        if self._step % self._steps == 0:
            reference = self._path.at(time_s + LEAD_S)
            command = exact_command(self._policy.gains, reference, in_plane(state))
            self._action = self._policy(self._view.look(state, command, self._action))
        self._step += 1
        return targets_rad(self._action)


def walk(case: Case, seed: int, seconds: float) -> Walk:
    """Walk the figure-eight from the origin."""
    path = find_path("figure-eight", 0.5, seconds + LEAD_S)
    plant = _plant(case, seed)
    sensors = SimulatedSensors(plant, case.sensors, seed)
    estimator, fixes = ESTIMATORS[case.estimator](plant), np.random.RandomState(seed)
    controllers = Controllers(path, round(CONTROL_DT_S / case.dt_s))
    true, estimated, update_s = [plant.state], [estimator.reset(sensors.read())], 0.0
    for step in range(1, round(seconds / case.dt_s) + 1):
        state = (estimated if case.closed else true)[-1]
        plant.hold(JOINTS, controllers.targets_rad(state, plant.time_s))
        plant.step()
        true.append(plant.state)
        fix = _fix(true[-1], fixes) if case.mocap and not step % _every(case) else None
        observed, begin = sensors.read(), time.process_time()
        estimated.append(estimator.update(observed, fix))
        update_s += time.process_time() - begin
        if fallen(true[-1].base_position[2], torso.rotation(true[-1].base_quaternion)[2, 2]):
            return Walk(path, true, estimated, update_s / step, True)
    return Walk(path, true, estimated, update_s / step, False)


def _every(case: Case) -> int:
    return round(FIX_DT_S / case.dt_s)


def _plant(case: Case, seed: int) -> Plant:
    plant = Plant()
    plant.model.opt.timestep = case.dt_s
    plant.model.geom_friction[:, 0] = case.friction
    plant.reset(seed)
    return plant


def _fix(state: RobotState, noise: np.random.RandomState) -> Fix:
    place = state.base_position + FIX_NOISE_M * noise.standard_normal(3)
    return Fix(place, torso.heading_rad(torso.rotation(state.base_quaternion)))


def errors(done: Walk, dt_s: float) -> dict[str, np.ndarray]:
    """Return the errors of a walk at every physics step after the first second.

    A walk that fell earlier only has its last step. Distances from the path are at all steps.
    """
    begin = min(round(SETTLING_S / dt_s), len(done.true) - 1)
    pairs = list(zip(done.true, done.estimated, strict=True))[begin:]
    turns = [[torso.rotation(s.base_quaternion) for s in pair] for pair in pairs]
    return {
        "velocity": np.array([e.base_linear_velocity - t.base_linear_velocity for t, e in pairs]),
        "tilt": np.array([np.linalg.norm(e[2] - t[2]) for t, e in turns]),
        "yaw": np.array([wrap(torso.heading_rad(e) - torso.heading_rad(t)) for t, e in turns]),
        "place": np.array([e.base_position - t.base_position for t, e in pairs]),
        "track": done.path.distances_m(np.array([t.base_position[:2] for t in done.true])),
    }


def row(case: Case, seeds: int, seconds: float) -> list[str]:
    """Return the errors of a case."""
    walks = [walk(case, seed, seconds) for seed in range(seeds)]
    found = [errors(done, case.dt_s) for done in walks]
    velocity, tilt, track = (
        np.concatenate([e[k] for e in found]) for k in ("velocity", "tilt", "track")
    )
    yaw, place = (max(np.linalg.norm(e[k][-1]) for e in found) for k in ("yaw", "place"))
    return [
        case.estimator,
        case.name,
        ", ".join(f"{value:.3f}" for value in np.sqrt(np.mean(velocity**2, axis=0))),
        f"{1000 * np.sqrt(np.mean(tilt**2)):.1f}",
        f"{1000 * yaw:.0f}",
        f"{place:.2f}",
        f"{np.sqrt(np.mean(track**2)):.3f}",
        f"{sum(done.fell for done in walks)} of {seeds}",
        f"{1e6 * np.median([done.update_s for done in walks]):.0f}",
    ]


def main() -> None:
    """Walk all cases; print the table, or write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=40.0)
    parser.add_argument("--seeds", type=at_least(1), default=3)
    parser.add_argument("--into", type=markdown_table.document)
    chosen = parser.parse_args()
    if chosen.seconds < max(case.dt_s for case in CASES):
        parser.error("--seconds: less than a step")
    rows = [row(case, chosen.seeds, chosen.seconds) for case in CASES]
    markdown_table.show(markdown_table.table(HEADS, rows), chosen.into)


if __name__ == "__main__":
    main()
