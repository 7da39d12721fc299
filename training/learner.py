"""PPO on many robots: rsl-rl's, with the symmetric networks and the noise of hidden units.

The noise of hidden units is part of the policy's observation, so that an update replays the sample
that was drawn.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import ArrayLike
from rsl_rl.algorithms import PPO
from rsl_rl.storage import RolloutStorage
from tensordict import TensorDict
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.robot.description import JOINTS
from spikeport.robot.mirror import JOINT, OBSERVATION, SCALAR
from spikeport.robot.walk_interface import ACTION_SIZE, CONTROL_DT_S, PARTS
from spikeport.training.curriculum import Stage
from spikeport.training.environment import WalkEnvironment
from spikeport.training.export import policy_of
from spikeport.training.hidden_noise import HiddenNoiseSource
from spikeport.training.networks import (
    NOISE_SIZE,
    SYMMETRY_BREAKING_SD,
    MirrorGaussian,
    MirrorModel,
    MirrorNetwork,
)
from spikeport.training.observation import PRIVILEGED
from spikeport.training.workers import ALONE, Worker

SCALES = {
    "linear velocity": 2.0,
    "angular velocity": 0.5,
    "gravity": 2.0,
    "command": 2.0,
    "joint angles": 1.0,
    "joint velocities": 0.1,
    "last action": 0.5,
}
"""Factors that bring the parts of an observation to a size near one."""

AVERAGING = 0.96
"""Share of the average actor that is kept in an update."""

TrainingFigures = dict[str, float]


@dataclass(frozen=True)
class LearnerOptions:
    """Size and pace of learning."""

    robots: int = 512
    horizon: int = 24
    epochs: int = 4
    minibatches: int = 4
    learning_rate: float = 1e-3
    desired_kl: float = 0.01
    initial_std: float = 0.5

    @property
    def steps(self) -> int:
        """Control steps from one update to the next."""
        return self.robots * self.horizon


class Learner:
    """Actor, critic and their optimiser; call `begin` before `collect` and `update`.

    Parameters
    ----------
    options : LearnerOptions
        Sizes, of all workers together.
    worker : Worker
        This process's worker; all workers call `update` at the same time.

    Attributes
    ----------
    worker : Worker
        This process's worker.
    robots : int
        Number of this worker's robots.
    actor, average : Module
        The network that acts in training, and its running average.
    """

    def __init__(self, options: LearnerOptions, worker: Worker = ALONE) -> None:
        self.options, self.worker = options, worker
        # Robots are dealt out in turn, so that workers have the same number, or one more.
        self.robots = len(range(worker.rank, options.robots, worker.world_size))
        sample = self._sample(0)
        scale = observation_scale()
        extra = torch.ones(len(PRIVILEGED.order) - len(scale))
        self.actor = MirrorNetwork(OBSERVATION, JOINT, scale, 0.1, SYMMETRY_BREAKING_SD)
        self.average = AveragedModel(self.actor, multi_avg_fn=get_ema_multi_avg_fn(AVERAGING))
        critic = MirrorNetwork(PRIVILEGED, SCALAR, torch.cat((scale, extra)), 1.0)
        self._distribution = MirrorGaussian(ACTION_SIZE, options.initial_std)
        self.ppo = PPO(
            MirrorModel(sample, "policy", self.actor, self._distribution),
            MirrorModel(sample, "privileged", critic),
            self._storage(sample),
            num_learning_epochs=options.epochs,
            num_mini_batches=options.minibatches,
            learning_rate=options.learning_rate,
            desired_kl=options.desired_kl,
            multi_gpu_cfg=None if worker == ALONE else _distributed(worker),
        )

    def begin(self, stage: Stage) -> None:
        """Apply a stage's settings of the learner."""
        self._noise = HiddenNoiseSource(stage.hidden_noise, self.robots, NOISE_SIZE)
        self._noisy = bool(stage.hidden_noise)
        in_use = [joint not in stage.held for joint in JOINTS]
        self.actor.use(in_use)
        self._distribution.explore(in_use)
        self.ppo.entropy_coef = stage.entropy
        # Noise of hidden units follows the observation, so the storage differs from stage to
        # stage.
        self.ppo.storage = self._storage(self._sample(NOISE_SIZE if self._noisy else 0))

    def collect(self, env: WalkEnvironment) -> TrainingFigures:
        """Let the robots act for one horizon; return falls and rewards per second."""
        log: list[dict[str, np.ndarray]] = []
        with torch.inference_mode():
            observed = self._look(env)
            for _ in range(self.options.horizon):
                outcome = env.step(self.ppo.act(observed).numpy())
                observed = self._look(env)
                self.ppo.process_env_step(
                    observed,
                    _tensor(outcome.reward),
                    # rsl-rl adds the value of the last state after a time-out: the robot did not
                    # cause that end.
                    torch.as_tensor(outcome.fallen | outcome.timed_out),
                    {"time_outs": torch.as_tensor(outcome.timed_out)},
                )
                log.append({"falls": outcome.fallen, "reward": outcome.reward, **outcome.terms})
            self.ppo.compute_returns(observed)
        return {name: mean / CONTROL_DT_S for name, mean in mean_figures(log).items()}

    def update(self) -> TrainingFigures:
        """Learn from the collected steps; return the losses and the learning rate."""
        losses = self.ppo.update()
        self.average.update_parameters(self.actor)
        return {**losses, "learning_rate": self.ppo.learning_rate}

    def policy(self) -> WalkingPolicy:
        """Return the actor that is evaluated and shipped: the average one."""
        return policy_of(self.average.module)

    def state(self) -> dict[str, object]:
        """Return the state that must be kept to go on learning."""
        return {**self.ppo.save(), "average": self.average.state_dict()}

    def load(self, state: Mapping[str, object]) -> None:
        """Continue from a kept state."""
        self.ppo.load(state, None, True)
        self.average.load_state_dict(state["average"])

    def _look(self, env: WalkEnvironment) -> TensorDict:
        values = _tensor(env.observe())
        if self._noisy:
            noise = self._noise.draw(torch.as_tensor(env.age == 0))
            values = torch.cat((values, noise), dim=1)
        return _observations(values, _tensor(env.observe_all()))

    def _sample(self, noise_size: int) -> TensorDict:
        sizes = (len(OBSERVATION.order) + noise_size, len(PRIVILEGED.order))
        return _observations(*(torch.zeros(self.robots, size) for size in sizes))

    def _storage(self, sample: TensorDict) -> RolloutStorage:
        return RolloutStorage("rl", self.robots, self.options.horizon, sample, [ACTION_SIZE])


def mean_figures(log: Sequence[Mapping[str, ArrayLike]]) -> TrainingFigures:
    """Return the mean of every figure over the entries of a log, and over the robots."""
    return {key: float(np.mean([entry[key] for entry in log])) for key in log[0]}


def _distributed(worker: Worker) -> dict[str, int]:
    return {"global_rank": worker.rank, "world_size": worker.world_size}


def _observations(policy: torch.Tensor, privileged: torch.Tensor) -> TensorDict:
    parts = {"policy": policy, "privileged": privileged}
    return TensorDict(parts, batch_size=[len(policy)])


def _tensor(array: np.ndarray) -> torch.Tensor:
    return torch.as_tensor(array, dtype=torch.float)


def observation_scale() -> torch.Tensor:
    """Return the factor of every part of an observation, ``(69,)``."""
    scale = torch.empty(len(OBSERVATION.order))
    for part, value in SCALES.items():
        scale[PARTS[part]] = value
    return scale
