"""Actor and critic that have the robot's symmetry by construction.

The hidden units form pairs (h, h') that change places when the input is mirrored:

    W1 = [A; A P]    W2, W3 = [[B, C], [C, B]]    action: W4 = [D, P D]    value: w4 = [d, d]

so that actor(P x) = P actor(x) and critic(P x) = critic(x). An exactly symmetric policy topples
from a symmetric stand; the actor's first bias, [c + k, c - k], may break the symmetry.
"""

import math
from collections.abc import Sequence

import torch
from rsl_rl.models import MLPModel
from rsl_rl.modules import GaussianDistribution
from tensordict import TensorDict
from torch import nn
from torch.nn import functional

from spikeport.robot.description import JOINTS
from spikeport.robot.mirror import JOINT, Mirror

WIDTH = 128
HIDDEN_LAYERS = 3
NOISE_SIZE = WIDTH * HIDDEN_LAYERS
SYMMETRY_BREAKING_SD = 0.15
HELD_STD = 1e-3
"""Standard deviation of an action that is not explored: almost 0, but usable as a divisor."""

TorchLayer = tuple[torch.Tensor, torch.Tensor]


def _uniform(rows: int, columns: int, fan_in: int) -> nn.Parameter:
    bound = 1 / math.sqrt(fan_in)
    return nn.Parameter(torch.empty(rows, columns).uniform_(-bound, bound))


class MirrorNetwork(nn.Module):
    """An ELU network of three hidden layers with the symmetry of the robot.

    Parameters
    ----------
    inputs : Mirror
        The mirror image of the input.
    outputs : Mirror
        The mirror image of the output.
    scale : Tensor, (inputs,)
        Factor of every input, folded into the first layer.
    output_gain : float
        Size of the last layer's weights, relative to the usual size.
    symmetry_breaking_sd : float
        Standard deviation of k, the part of the first bias that breaks the symmetry; 0: no k.
    """

    def __init__(
        self,
        inputs: Mirror,
        outputs: Mirror,
        scale: torch.Tensor,
        output_gain: float,
        symmetry_breaking_sd: float = 0.0,
    ) -> None:
        super().__init__()
        half, n_in, n_out = WIDTH // 2, len(inputs.order), len(outputs.order)
        self.register_buffer("scale", scale)
        for name, mirror in (("in", inputs), ("out", outputs)):
            self.register_buffer(f"{name}_index", torch.as_tensor(mirror.order))
            self.register_buffer(f"{name}_sign", torch.as_tensor(mirror.sign, dtype=torch.float))
        self.register_buffer("in_use", torch.ones(n_out))
        self.A = _uniform(half, n_in, n_in)
        self.B = nn.ParameterList(_uniform(half, half, WIDTH) for _ in range(HIDDEN_LAYERS - 1))
        self.C = nn.ParameterList(_uniform(half, half, WIDTH) for _ in range(HIDDEN_LAYERS - 1))
        self.D = nn.Parameter(output_gain * _uniform(n_out, half, WIDTH).detach())
        self.c = nn.ParameterList(nn.Parameter(torch.zeros(half)) for _ in range(HIDDEN_LAYERS))
        self.e = nn.Parameter(torch.zeros(n_out))
        # Without `k` a policy that is its own mirror image could not begin to step with one foot.
        k = symmetry_breaking_sd * torch.randn(half)
        self.k = nn.Parameter(k, requires_grad=symmetry_breaking_sd > 0)

    def layers(self) -> list[TorchLayer]:
        """Return the layers' weights ``(outputs, inputs)`` and biases, as an ordinary network's."""
        A = self.A * self.scale
        mirrored = A[:, self.in_index] * self.in_sign
        layers = [(torch.cat((A, mirrored)), torch.cat((self.c[0] + self.k, self.c[0] - self.k)))]
        for B, C, c in zip(self.B, self.C, list(self.c)[1:], strict=True):
            W = torch.cat((torch.cat((B, C), dim=1), torch.cat((C, B), dim=1)))
            layers.append((W, torch.cat((c, c))))
        D = torch.cat((self.D, self._mirror_rows(self.D)), dim=1)
        # The mean of both sides, which is its own mirror image.
        e = (self.e + self._mirror_rows(self.e)) / 2
        return [*layers, (self.in_use[:, None] * D, self.in_use * e)]

    def use(self, outputs: Sequence[bool]) -> None:
        """Set the outputs that are not in use to 0."""
        self.in_use.copy_(torch.as_tensor(outputs))

    def _mirror_rows(self, x: torch.Tensor) -> torch.Tensor:
        sign = self.out_sign if x.ndim == 1 else self.out_sign[:, None]
        return x[self.out_index] * sign

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return the output; noise of the hidden units, ``(n, 384)``, may follow the input.

        The noise grows with their activity: h += (1 + |h|) noise.
        """
        n_in = len(self.scale)
        x, noise = x[:, :n_in], x[:, n_in:].split(WIDTH, dim=1)
        *hidden, last = self.layers()
        for i, (W, b) in enumerate(hidden):
            x = functional.elu(functional.linear(x, W, b), inplace=True)
            if len(noise) == len(hidden):
                x = torch.addcmul(x, 1 + x.abs(), noise[i])
        return functional.linear(x, *last)


class MirrorGaussian(GaussianDistribution):
    """Gaussian actions whose standard deviation is the same on both sides, and capped per joint.

    Hip yaw and torso begin above their caps and stay at them: a minimum has no gradient there.
    """

    def __init__(self, output_dim: int, init_std: float) -> None:
        super().__init__(output_dim, init_std, std_type="log")
        self.register_buffer("other_side", torch.as_tensor(JOINT.order))
        self.register_buffer("largest", torch.empty(output_dim))
        self.explore([True] * output_dim)

    def explore(self, joints: Sequence[bool]) -> None:
        """Explore with the actions of some joints; the others hardly vary."""
        kept = zip(JOINTS, joints, strict=True)
        largest = [_largest_std(joint) if explored else HELD_STD for joint, explored in kept]
        self.largest.copy_(torch.tensor(largest))

    def update(self, mlp_output: torch.Tensor) -> None:
        """Centre the distribution on the network's output."""
        # The mean of both sides, as for the output's bias.
        log_std = (self.log_std_param + self.log_std_param[self.other_side]) / 2
        std = torch.minimum(log_std.exp(), self.largest)
        self._distribution = torch.distributions.Normal(mlp_output, std.expand_as(mlp_output))


def _largest_std(joint: str) -> float:
    return {"torso": 0.15, "left_hip_yaw": 0.2, "right_hip_yaw": 0.2}.get(joint, 1.0)


class MirrorModel(MLPModel):
    """rsl-rl's model around a `MirrorNetwork`."""

    def __init__(
        self,
        observations: TensorDict,
        group: str,
        network: MirrorNetwork,
        distribution: GaussianDistribution | None = None,
    ) -> None:
        output_dim = len(network.out_index)
        # rsl-rl builds the smallest network, and the next line replaces it.
        super().__init__(observations, {"all": [group]}, "all", output_dim, hidden_dims=(1,))
        self.mlp = network
        self.distribution = distribution

    def get_latent(self, obs: TensorDict, *_: object) -> torch.Tensor:
        """Return the only group that the network reads, without a copy."""
        return obs[self.obs_groups[0]]
