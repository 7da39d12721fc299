"""Many robots that learn to walk, stepped together by MuJoCo's rollout.

Per control step: action -> delayed joint targets -> 4 physics steps in C -> rewards, falls, new
commands, pushes -> observation.
"""

import copy
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from mujoco.rollout import Rollout

from spikeport.arrays import Flags, Floats
from spikeport.robot.description import KD, KP
from spikeport.robot.engine import mujoco
from spikeport.robot.walk_interface import (
    ACTION_SIZE,
    CONTROL_DT_S,
    LOWEST_PELVIS_M,
    POSE_RAD,
    SMALLEST_UPRIGHT,
    targets_rad,
)
from spikeport.training import model as models
from spikeport.training import observation
from spikeport.training.busy_arms import BusyArms
from spikeport.training.commands import CommandRange, Commands
from spikeport.training.gait import Gait
from spikeport.training.motion import FeetMotion, Motion, in_frame, rotations
from spikeport.training.randomisation import SUBSTEPS, Bodies, Randomisation
from spikeport.training.rewards import RewardScales, Step, Weights, reward
from spikeport.training.terrain import Ground, Planes
from spikeport.training.velocity_belief import VelocityBelief

EPISODE_STEPS = 1000
START_HEIGHT_M = 1.04
FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS
"""MuJoCo's kind of state: time, positions and velocities."""
_HEIGHT = 3
"""Place of the pelvis' height in a state."""
VELOCITY_SMOOTHING, YAW_RATE_SMOOTHING, DRIFT_SMOOTHING = 0.3, 0.1, 0.04


@dataclass(frozen=True)
class TrainingTask:
    """The commands to the robots, their disturbances, and their rewards."""

    commands: CommandRange = field(default_factory=CommandRange)
    randomisation: Randomisation = field(default_factory=Randomisation)
    weights: Weights = field(default_factory=Weights)
    scales: RewardScales = field(default_factory=RewardScales)


class StepOutcome(NamedTuple):
    """The outcome of one control step of n robots: ``(n,)`` each, and every term of the reward.

    Without terms the reward is the number 0.
    """

    reward: Floats
    fallen: Flags
    timed_out: Flags
    terms: dict[str, Floats]


class WalkEnvironment:
    """n robots, each with its own body, commands and clocks; robots that are done start over.

    Parameters
    ----------
    n : int
        Number of robots.
    task : TrainingTask
        Their task.
    seed : int
        Seed of all random draws.
    threads : int
        Threads of the physics.
    """

    def __init__(self, n: int, task: TrainingTask, seed: int, threads: int = 2) -> None:
        self.n, self.task = n, task
        self._rng = np.random.default_rng(seed)
        nominal = models.build_model()
        self._bodies = Bodies(nominal)
        # Bodies differ, so each robot has a model; scratch data are per thread.
        self._models = [copy.copy(nominal) for _ in range(n)]
        self._ground = Ground(n, self._rng)
        left, right = (nominal.geom(plane).id for plane in models.PLANES)
        self._planes = Planes(self._models, (left, right))
        self._data = [mujoco.MjData(nominal) for _ in range(threads)]
        self._rollout = Rollout(nthread=threads)
        self._start = _start_state(nominal)
        sizes = {"state": len(self._start), "sensordata": nominal.nsensordata}
        self._out = {name: np.empty((n, SUBSTEPS, size)) for name, size in sizes.items()}
        self._limit_nm = nominal.actuator_forcerange[:, 1]
        self.states = np.tile(self._start, (n, 1))
        # The states of a control step's physics steps, for delayed observations.
        self._recent = np.tile(self._start, (n, SUBSTEPS + 1, 1))
        self._targets, self._arrived_targets = np.tile(POSE_RAD, (2, n, 1))
        newest, last, oldest = np.zeros((3, n, ACTION_SIZE))
        self.actions = (newest, last, oldest)
        self.delay, self.observation_delay = np.zeros((2, n), int)
        self.joint_offset = np.zeros((n, ACTION_SIZE))
        self.velocity, self.yaw_rate, self.drift = np.zeros((n, 2)), np.zeros(n), np.zeros((n, 3))
        self.age = np.zeros(n, int)
        self.gait = Gait(n)
        self.commands = Commands(n, task.commands, self._rng)
        self._arms = BusyArms(n, task.randomisation.busy_arms, self._rng)
        self.belief = VelocityBelief(n, task.randomisation.estimator, self._rng)
        self._sensors = np.zeros((n, nominal.nsensordata))
        self._reset(np.ones(n, bool))
        self._update_motion()

    def close(self) -> None:
        """End the threads of the physics."""
        self._rollout.close()

    def spread_ages(self) -> None:
        """Let episodes end at different times, not all at once."""
        self.age = self._rng.integers(0, EPISODE_STEPS, self.n)

    def observe(self) -> Floats:
        """Return the policy's observations, ``(n, 69)``, with noise."""
        return observation.noisy(self, self._rng)

    def observe_all(self) -> Floats:
        """Return the critic's observations."""
        return observation.privileged(self)

    def step(self, action: np.ndarray) -> StepOutcome:
        """Act for one control step, ``action (n, 19)``."""
        dq_before, feet_before = self.motion.dq, self.feet
        diverged = self._advance(np.array(action, dtype=float))
        self._update_motion()
        self.gait.update(self.feet.contact)
        self._smooth()
        self.age += 1
        fallen = diverged | (self.pelvis_m < LOWEST_PELVIS_M)
        fallen |= -self.motion.gravity[:, 2] < SMALLEST_UPRIGHT
        terms = reward(self._reward_step(dq_before, feet_before, fallen), self.task.weights)
        timed_out = ~fallen & (self.age >= EPISODE_STEPS)
        self._begin_next(fallen | timed_out)
        return StepOutcome(np.sum(list(terms.values()), axis=0), fallen, timed_out, terms)

    def _advance(self, action: Floats) -> Flags:
        """Advance physics by a control step; return which robots diverged, ``(n,)``."""
        self.actions = (action, self.actions[0], self.actions[1])
        noise = self.task.randomisation.action_noise_sd
        jitter = noise * self._rng.standard_normal(action.shape) if noise else 0.0
        targets = targets_rad(action + jitter) + self.joint_offset
        targets = self._arms.override(targets, ~self.commands.moving)
        # Until a target arrives, the one before it holds.
        late = np.arange(SUBSTEPS) < self.delay[:, None]
        control = np.where(late[..., None], self._targets[:, None], targets[:, None])
        states, sensors = self._rollout.rollout(
            self._models,
            self._data,
            self.states,
            control,
            nstep=SUBSTEPS,
            skip_checks=True,
            **self._out,
        )
        diverged: Flags = ~np.isfinite(states[:, -1]).all(axis=1)
        self._recent[:, 0] = self.states
        # A state that is not finite would spread. Its robot counts as fallen, and starts over.
        self._recent[:, 1:] = np.where(diverged[:, None, None], self._start, states)
        self.states = self._recent[:, -1].copy()
        self._sensors = np.nan_to_num(sensors[:, -1])
        self._update_feet()
        self._lay_planes()
        self._targets, self._arrived_targets = targets, control[:, -1]
        return diverged

    def _update_feet(self) -> None:
        self.feet = FeetMotion.from_sensors(self._sensors, self._ground.height_m)

    def _lay_planes(self) -> None:
        """Lay planes through the ground below heel and toe of the feet in the air."""
        feet = self.feet
        below = feet.points.copy()
        below[..., 2] = feet.ground_m
        along = below[:, :, 1] - below[:, :, 0]
        along /= np.linalg.norm(along, axis=-1, keepdims=True)
        self._planes.lay(~feet.contact & (feet.height_m > 0), below[:, :, 0], along)

    def _update_motion(self) -> None:
        """Update the motion: the true one and the observed one."""
        self.motion = Motion.from_states(*self._split())
        self.ground_m = self._ground.height_m(self.states[:, None, 1:3])[:, 0]
        late = self._recent[np.arange(self.n), SUBSTEPS - self.observation_delay]
        self.observed = Motion.from_states(late[:, 1:27], late[:, 27:])
        age = self.observation_delay / SUBSTEPS
        self.estimated_velocity = self.belief.estimate(self.observed.velocity, age)

    @property
    def pelvis_m(self) -> Floats:
        """Height of the pelvis above the ground below it, ``(n,)``, m."""
        return np.asarray(self.motion.height_m - self.ground_m)

    def _smooth(self) -> None:
        motion = self.motion
        self.velocity += VELOCITY_SMOOTHING * (motion.level_velocity[:, :2] - self.velocity)
        self.yaw_rate += YAW_RATE_SMOOTHING * (motion.yaw_rate - self.yaw_rate)
        speed = np.column_stack((motion.level_velocity[:, :2], motion.yaw_rate))
        self.drift += DRIFT_SMOOTHING * (self.commands.value - speed - self.drift)
        slip = in_frame(rotations(self.states[:, 4:8]), self.feet.lowest_velocity)
        self.belief.update(motion.velocity, slip)

    def _reward_step(self, dq_before: Floats, feet_before: FeetMotion, fallen: Flags) -> Step:
        motion = self.motion
        torque = KP * (self._arrived_targets - motion.q) - KD * motion.dq
        return Step(
            motion=motion,
            feet=self.feet,
            feet_before=feet_before,
            pelvis_m=self.pelvis_m,
            even=self._ground.even,
            gait=self.gait,
            command=self.commands.value,
            moving=self.commands.moving,
            moving_s=self.commands.moving_s,
            velocity=self.velocity,
            yaw_rate=self.yaw_rate,
            drift=self.drift,
            actions=self.actions,
            joint_acceleration=(motion.dq - dq_before) / CONTROL_DT_S,
            torque_nm=np.clip(torque, -self._limit_nm, self._limit_nm),
            fallen=fallen,
            scales=self.task.scales,
        )

    def _begin_next(self, done: Flags) -> None:
        self.commands.update(self.motion.heading_rad)
        self._push()
        if done.any():
            self._reset(done)
        # Pushes and new starts have changed the newest states.
        self._recent[:, -1] = self.states
        self._update_motion()

    def _push(self) -> None:
        ranges, rng = self.task.randomisation, self._rng
        pushed = rng.random(self.n) < CONTROL_DT_S / ranges.push_every_s
        change = rng.uniform(-ranges.push_m_s, ranges.push_m_s, (self.n, 2))
        # A view of the states: the first two velocities are the pelvis', in the world frame.
        self._split()[1][:, :2] += change * pushed[:, None]

    def _reset(self, which: Flags) -> None:
        ranges, rng, k = self.task.randomisation, self._rng, int(np.count_nonzero(which))
        for index in np.flatnonzero(which):
            self._bodies.draw(self._models[index], ranges, rng)
        self.delay[which] = rng.integers(*ranges.delay_steps, k, endpoint=True)
        late = ranges.observation_delay_steps
        self.observation_delay[which] = rng.integers(*late, k, endpoint=True)
        self.joint_offset[which] = ranges.joint_offset_sd_rad * rng.standard_normal(
            (k, ACTION_SIZE)
        )
        self._ground.draw(which, ranges.terrain)
        self.states[which] = self._standing(which)
        self._feel(which)
        # Lowered until a foot touches the floor: a fall would cost what no action can change.
        self.states[which, _HEIGHT] -= self.feet.clearance_m[which].min(axis=(1, 2))
        self._feel(which)
        self._recent[which] = self.states[which, None]
        self.belief.restart(which)
        self._targets[which] = POSE_RAD
        for past in self.actions:
            past[which] = 0.0
        for smoothed in (self.velocity, self.yaw_rate, self.drift):
            smoothed[which] = 0.0
        self.age[which] = 0
        self.gait.reset(which)
        self._arms.restart(which)
        self.commands.restart(which)

    def _standing(self, which: Flags) -> Floats:
        """Return states near the default pose, slow, with any heading; also lay the planes."""
        k, rng = int(np.count_nonzero(which)), self._rng
        state = np.tile(self._start, (k, 1))
        qpos, qvel = state[:, 1:27], state[:, 27:]
        heading = rng.uniform(-np.pi, np.pi, k)
        # The quaternion [w, 0, 0, z] of a turn about the vertical.
        qpos[:, 3], qpos[:, 6] = np.cos(heading / 2), np.sin(heading / 2)
        qpos[:, 7:] += rng.uniform(-0.05, 0.05, (k, ACTION_SIZE))
        qvel[:, :2] = rng.uniform(-0.1, 0.1, (k, 2))
        level = self._ground.height_m(np.zeros((self.n, 1, 2)))
        qpos[:, 2] += level[which, 0]
        self._lay_level(which, level)
        return state

    def _feel(self, which: Flags) -> None:
        """Read the sensors of some robots before they move."""
        data = self._data[0]
        for index in np.flatnonzero(which):
            model = self._models[index]
            mujoco.mj_setState(model, data, self.states[index], FULL)
            mujoco.mj_forward(model, data)
            self._sensors[index] = data.sensordata
        self._update_feet()

    def _lay_level(self, which: Flags, height_m: Floats) -> None:
        """Lay both planes of some robots level at a height ``(n, 1)``, for their start."""
        place = np.zeros((self.n, 2, 3))
        place[..., 2] = height_m
        along = np.tile([1.0, 0.0, 0.0], (self.n, 2, 1))
        self._planes.lay(np.tile(which[:, None], 2), place, along)

    def _split(self) -> tuple[Floats, Floats]:
        # MuJoCo's full physics: the time, 26 positions, 25 velocities.
        return self.states[:, 1:27], self.states[:, 27:]


def _start_state(model: mujoco.MjModel) -> Floats:
    data = mujoco.MjData(model)
    data.qpos[2], data.qpos[7:] = START_HEIGHT_M, POSE_RAD
    state = np.empty(mujoco.mj_stateSize(model, FULL))
    mujoco.mj_getState(model, data, state, FULL)
    return state
