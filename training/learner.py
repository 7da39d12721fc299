"""PPO on many robots: rsl-rl's, with the symmetric networks and the noise of hidden units.

The noise of hidden units is an observation, so that an update replays the sample that was drawn.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from rsl_rl.algorithms import PPO
from rsl_rl.storage import RolloutStorage
from tensordict import TensorDict

from spikeport.robot.walk_interface import ACTION_SIZE, CONTROL_DT_S, PARTS
from spikeport.training.curriculum import Stage
from spikeport.training.environment import WalkEnvironment
from spikeport.training.mirror import JOINT, OBSERVATION, SCALAR
from spikeport.training.networks import (
    NOISE_SIZE,
    SYMMETRY_BREAKING_SD,
    MirrorGaussian,
    MirrorModel,
    MirrorNetwork,
)
from spikeport.training.observation import PRIVILEGED

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

Figures = dict[str, float]


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
    """Actor, critic and their optimiser; `begin` comes before `collect` and `update`."""

    def __init__(self, options: LearnerOptions) -> None:
        self.options = options
        sample = self._sample(0)
        scale = _scale()
        extra = torch.ones(len(PRIVILEGED.order) - len(scale))
        self.actor = MirrorNetwork(OBSERVATION, JOINT, scale, 0.1, SYMMETRY_BREAKING_SD)
        critic = MirrorNetwork(PRIVILEGED, SCALAR, torch.cat((scale, extra)), 1.0)
        noisy = MirrorGaussian(ACTION_SIZE, options.initial_std)
        self.ppo = PPO(
            MirrorModel(sample, ["policy", "hidden_noise"], self.actor, noisy),
            MirrorModel(sample, ["privileged"], critic),
            self._storage(sample),
            num_learning_epochs=options.epochs,
            num_mini_batches=options.minibatches,
            learning_rate=options.learning_rate,
            desired_kl=options.desired_kl,
        )

    def begin(self, stage: Stage) -> None:
        """Take over what a stage asks of the learner."""
        self._noise_size = NOISE_SIZE if stage.hidden_noise else 0
        self.actor.noise = stage.hidden_noise
        self.ppo.entropy_coef = stage.entropy
        self.ppo.storage = self._storage(self._sample(self._noise_size))

    def collect(self, env: WalkEnvironment) -> Figures:
        """Let the robots act for one horizon; returns falls and rewards per second."""
        log: list[Figures] = []
        with torch.inference_mode():
            seen = self._look(env)
            for _ in range(self.options.horizon):
                outcome = env.step(self.ppo.act(seen).numpy())
                seen = self._look(env)
                self.ppo.process_env_step(
                    seen,
                    _tensor(outcome.reward),
                    torch.as_tensor(outcome.fallen | outcome.timed_out),
                    {"time_outs": torch.as_tensor(outcome.timed_out)},
                )
                happened = {"falls": outcome.fallen, "reward": outcome.reward, **outcome.terms}
                log.append({k: float(v.mean()) / CONTROL_DT_S for k, v in happened.items()})
            self.ppo.compute_returns(seen)
        return mean_figures(log)

    def update(self) -> Figures:
        """Learn from what was collected; returns the losses and the pace."""
        return {**self.ppo.update(), "learning_rate": self.ppo.learning_rate}

    def state(self) -> dict[str, Any]:
        """All that must be kept to go on learning."""
        return self.ppo.save()

    def load(self, state: dict[str, Any]) -> None:
        """Go on from a kept state."""
        self.ppo.load(state, None, True)

    def _look(self, env: WalkEnvironment) -> TensorDict:
        noise = torch.randn(env.n, self._noise_size)
        return _observations(_tensor(env.observe()), _tensor(env.observe_all()), noise)

    def _sample(self, noise_size: int) -> TensorDict:
        sizes = (len(OBSERVATION.order), len(PRIVILEGED.order), noise_size)
        return _observations(*(torch.zeros(self.options.robots, size) for size in sizes))

    def _storage(self, sample: TensorDict) -> RolloutStorage:
        options = self.options
        return RolloutStorage("rl", options.robots, options.horizon, sample, [ACTION_SIZE])


def mean_figures(log: list[Figures]) -> Figures:
    """Mean of every figure over the entries of a log."""
    return {key: float(np.mean([entry[key] for entry in log])) for key in log[0]}


def _observations(
    policy: torch.Tensor, privileged: torch.Tensor, noise: torch.Tensor
) -> TensorDict:
    parts = {"policy": policy, "privileged": privileged, "hidden_noise": noise}
    return TensorDict(parts, batch_size=[len(policy)])


def _tensor(array: np.ndarray) -> torch.Tensor:
    return torch.as_tensor(array, dtype=torch.float)


def _scale() -> torch.Tensor:
    scale = torch.empty(len(OBSERVATION.order))
    for part, value in SCALES.items():
        scale[PARTS[part]] = value
    return scale
