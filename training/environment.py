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
from spikeport.robot.engine import mujoco
from spikeport.robot.walk_interface import (
    ACTION_SIZE,
    CONTROL_DT_S,
    POSE_RAD,
    targets_rad,
)
from spikeport.training import model as models
from spikeport.training import observation
from spikeport.training.busy_arms import BusyArms
from spikeport.training.commands import CommandRange, Commands
from spikeport.training.gait import Gait
from spikeport.training.motion import FeetMotion, Motion
from spikeport.training.randomisation import SUBSTEPS, Bodies, Randomisation
from spikeport.training.rewards import RewardSettings, Step, Weights, reward

EPISODE_STEPS = 1000
START_HEIGHT_M = 1.04
LOWEST_PELVIS_M = 0.7
LARGEST_TILT = np.cos(np.pi / 4)
VELOCITY_SMOOTHING, YAW_RATE_SMOOTHING, DRIFT_SMOOTHING = 0.3, 0.1, 0.04


@dataclass(frozen=True)
class TrainingTask:
    """The commands to the robots, and what happens to them."""

    commands: CommandRange = field(default_factory=CommandRange)
    randomisation: Randomisation = field(default_factory=Randomisation)
    weights: Weights = field(default_factory=Weights)
    scales: RewardSettings = field(default_factory=RewardSettings)


class StepOutcome(NamedTuple):
    """The outcome of one control step of n robots: ``(n,)`` each, and every term of the reward."""

    reward: Floats
    fallen: Flags
    timed_out: Flags
    terms: dict[str, Floats]


class WalkEnvironment:
    """n robots with bodies, commands and clocks of their own; robots that are done start over.

    Parameters
    ----------
    n : int
        Number of robots.
    task : TrainingTask
        What they do.
    seed : int
        Seed of all that is random.
    threads : int
        Threads of the physics.
    """

    def __init__(self, n: int, task: TrainingTask, seed: int, threads: int = 2) -> None:
        self.n, self.task = n, task
        self._rng = np.random.default_rng(seed)
        nominal = models.build_model()
        self._bodies = Bodies(nominal)
        self._models = [copy.copy(nominal) for _ in range(n)]
        self._data = [mujoco.MjData(nominal) for _ in range(threads)]
        self._rollout = Rollout(nthread=threads)
        self._start = _start_state(nominal)
        sizes = {"state": len(self._start), "sensordata": nominal.nsensordata}
        self._out = {name: np.empty((n, SUBSTEPS, size)) for name, size in sizes.items()}
        self._limit_nm = nominal.actuator_forcerange[:, 1]
        self.states = np.tile(self._start, (n, 1))
        self._targets = np.tile(POSE_RAD, (n, 1))
        newest, last, oldest = np.zeros((3, n, ACTION_SIZE))
        self.actions = (newest, last, oldest)
        self.delay = np.zeros(n, int)
        self.joint_offset = np.zeros((n, ACTION_SIZE))
        self.velocity, self.yaw_rate, self.drift = np.zeros((n, 2)), np.zeros(n), np.zeros((n, 3))
        self.age = np.zeros(n, int)
        self.gait = Gait(n)
        self.commands = Commands(n, task.commands, self._rng)
        self._arms = BusyArms(n, task.randomisation.busy_arms, self._rng)
        self._reset(np.ones(n, bool))
        still = (np.zeros(size) for size in ((n, 2), (n, 2), (n, 2, 3)))
        self.feet = FeetMotion(np.zeros((n, 2), bool), *still)
        self.motion = Motion.from_states(*self._split())

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
        before = self.motion.dq
        diverged = self._advance(np.array(action, dtype=float))
        self.motion = Motion.from_states(*self._split())
        self.gait.update(self.feet.contact)
        self._smooth()
        self.age += 1
        fallen = diverged | (self.motion.height_m < LOWEST_PELVIS_M)
        fallen |= -self.motion.gravity[:, 2] < LARGEST_TILT
        terms = reward(self._reward_step(before, fallen), self.task.weights)
        timed_out = ~fallen & (self.age >= EPISODE_STEPS)
        self._begin_next(fallen | timed_out)
        return StepOutcome(np.sum(list(terms.values()), axis=0), fallen, timed_out, terms)

    def _advance(self, action: Floats) -> Flags:
        """Physics of one control step; returns who left the range of finite numbers, ``(n,)``."""
        self.actions = (action, self.actions[0], self.actions[1])
        noise = self.task.randomisation.action_noise_sd
        jitter = noise * self._rng.standard_normal(action.shape) if noise else 0.0
        targets = targets_rad(action + jitter) + self.joint_offset
        targets = self._arms.override(targets, ~self.commands.moving)
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
        self.states = np.where(diverged[:, None], self._start, states[:, -1])
        self.feet = FeetMotion.from_sensors(np.nan_to_num(sensors[:, -1]))
        self._targets = targets
        return diverged

    def _smooth(self) -> None:
        motion = self.motion
        self.velocity += VELOCITY_SMOOTHING * (motion.level_velocity[:, :2] - self.velocity)
        self.yaw_rate += YAW_RATE_SMOOTHING * (motion.yaw_rate - self.yaw_rate)
        speed = np.column_stack((motion.level_velocity[:, :2], motion.yaw_rate))
        self.drift += DRIFT_SMOOTHING * (self.commands.value - speed - self.drift)

    def _reward_step(self, dq_before: Floats, fallen: Flags) -> Step:
        motion = self.motion
        torque = models.KP * (self._targets - motion.q) - models.KD * motion.dq
        return Step(
            motion=motion,
            feet=self.feet,
            gait=self.gait,
            command=self.commands.value,
            moving=self.commands.moving,
            velocity=self.velocity,
            yaw_rate=self.yaw_rate,
            drift=self.drift,
            actions=self.actions,
            joint_acceleration=(motion.dq - dq_before) / CONTROL_DT_S,
            torque_nm=np.clip(torque, -self._limit_nm, self._limit_nm),
            fallen=fallen,
            settings=self.task.scales,
        )

    def _begin_next(self, done: Flags) -> None:
        self.commands.update(self.motion.heading_rad)
        self._push()
        if done.any():
            self._reset(done)
        self.motion = Motion.from_states(*self._split())

    def _push(self) -> None:
        ranges, rng = self.task.randomisation, self._rng
        pushed = rng.random(self.n) < CONTROL_DT_S / ranges.push_every_s
        change = rng.uniform(-ranges.push_m_s, ranges.push_m_s, (self.n, 2))
        self._split()[1][:, :2] += change * pushed[:, None]

    def _reset(self, which: Flags) -> None:
        ranges, rng, k = self.task.randomisation, self._rng, int(np.count_nonzero(which))
        for index in np.flatnonzero(which):
            self._bodies.draw(self._models[index], ranges, rng)
        low, high = ranges.delay_steps
        self.delay[which] = rng.integers(low, high + 1, k)
        self.joint_offset[which] = ranges.joint_offset_sd_rad * rng.standard_normal(
            (k, ACTION_SIZE)
        )
        self.states[which] = self._standing(k)
        self._targets[which] = POSE_RAD
        for past in self.actions:
            past[which] = 0.0
        for smoothed in (self.velocity, self.yaw_rate, self.drift):
            smoothed[which] = 0.0
        self.age[which] = 0
        self.gait.reset(which)
        self._arms.restart(which)
        self.commands.restart(which)

    def _standing(self, k: int) -> Floats:
        """States of k robots near the default pose, looking anywhere, moving slowly."""
        rng, state = self._rng, np.tile(self._start, (k, 1))
        qpos, qvel = state[:, 1:27], state[:, 27:]
        heading = rng.uniform(-np.pi, np.pi, k)
        qpos[:, 3], qpos[:, 6] = np.cos(heading / 2), np.sin(heading / 2)
        qpos[:, 7:] += rng.uniform(-0.05, 0.05, (k, ACTION_SIZE))
        qvel[:, :2] = rng.uniform(-0.1, 0.1, (k, 2))
        return state

    def _split(self) -> tuple[Floats, Floats]:
        return self.states[:, 1:27], self.states[:, 27:]


def _start_state(model: mujoco.MjModel) -> Floats:
    data = mujoco.MjData(model)
    data.qpos[2], data.qpos[7:] = START_HEIGHT_M, POSE_RAD
    full = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.empty(mujoco.mj_stateSize(model, full))
    mujoco.mj_getState(model, data, state, full)
    return state
