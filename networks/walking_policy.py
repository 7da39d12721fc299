"""The walking policy as an ordinary network: weights, biases, and the robot they are made for.

h_0 = observation,    h_i = elu(W_i h_{i-1} + b_i),    action = W_n h_{n-1} + b_n
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from spikeport.files import write_arrays
from spikeport.networks.activations import elu
from spikeport.networks.loading.refusal import refusing
from spikeport.networks.path_following import FollowerGains
from spikeport.networks.policy_values import Layer
from spikeport.reading import npz
from spikeport.reading.mismatch import MismatchError

POLICIES = {file.stem: file for file in sorted(Path(__file__).with_name("policies").glob("*.npz"))}
"""The policies that come with this package, by name; their model cards lie beside them."""
SHIPPED = POLICIES["h1_walk"]
"""The default of them."""

NUMBERS, TEXTS = "iuf", "U"
"""Types of arrays, by NumPy's letters."""

_FIELDS = {
    "joints": (TEXTS, 1),
    "pose_rad": (NUMBERS, 1),
    "action_scale_rad": (NUMBERS, 0),
    "activation": (TEXTS, 0),
}
"""The arrays of a file besides layers: their types and numbers of axes."""

_AXES = {"weights": 2, "biases": 1}
_GAINS = "follower_gains"
"""The array with kp_speed and kp_heading; a file without it asks for the default gains."""
LARGEST_GAIN = 20.0
"""The largest gain accepted, in 1/s. Gains that training measures are at most a quarter of it."""

CURE = "make one with: spikeport train walk"


@dataclass(frozen=True)
class WalkingPolicy:
    """A policy of a robot's joints.

    Attributes
    ----------
    weights, biases : tuple of ndarray
        The parameters of every layer, ``(outputs, inputs)`` and ``(outputs,)``.
    joints : tuple of str
        The joints in the order of the actions.
    pose_rad : ndarray, (joints,)
        The pose that the zero action asks for.
    action_scale_rad : float
        Change of a joint's target for an action of 1.
    gains : FollowerGains
        Gains with which a path follower commands this policy.
    """

    weights: tuple[np.ndarray, ...]
    biases: tuple[np.ndarray, ...]
    joints: tuple[str, ...]
    pose_rad: np.ndarray
    action_scale_rad: float
    gains: FollowerGains = field(default_factory=FollowerGains)

    @property
    def layers(self) -> tuple[Layer, ...]:
        """The parameters layer by layer."""
        return tuple(map(Layer, self.weights, self.biases))

    def __call__(self, observation: ArrayLike) -> np.ndarray:
        """Return the actions ``(..., joints)`` for observations ``(..., inputs)``."""
        x = np.asarray(observation, dtype=float)
        for W, b in zip(self.weights[:-1], self.biases[:-1], strict=True):
            x = elu(x @ W.T + b)
        action: np.ndarray = x @ self.weights[-1].T + self.biases[-1]
        return action

    def save(self, path: Path) -> None:
        """Write the policy, whole or not at all."""
        arrays: dict[str, ArrayLike] = {"activation": "elu"}
        arrays |= {f"weights_{i}": W for i, W in enumerate(self.weights)}
        arrays |= {f"biases_{i}": b for i, b in enumerate(self.biases)}
        arrays |= {name: getattr(self, name) for name in _FIELDS if name != "activation"}
        arrays[_GAINS] = np.array([self.gains.kp_speed, self.gains.kp_heading])
        write_arrays(path, arrays)


def load(path: Path = SHIPPED) -> WalkingPolicy:
    """Read a policy that `WalkingPolicy.save` wrote; by default `SHIPPED`.

    Raises
    ------
    UsageError
        The file holds something else, layers do not fit each other, a number is not finite, the
        action scale or a gain is not above 0, a gain is above `LARGEST_GAIN`, or a joint is there
        twice.
    """
    with refusing(path, cure=CURE):
        return _policy(npz.read(path))


def _policy(arrays: dict[str, np.ndarray]) -> WalkingPolicy:
    layers = sum(name.startswith("weights_") for name in arrays)
    missing = [name for name in _FIELDS if name not in arrays]
    if missing or not layers:
        raise MismatchError("weights, biases and " + ", ".join(_FIELDS), "arrays missing")
    for name, (kinds, axes) in _FIELDS.items():
        _check_array(name, arrays[name], kinds, axes)
    weights, biases = (_numbered(arrays, kind, layers) for kind in ("weights", "biases"))
    joints = tuple(str(joint) for joint in arrays["joints"])
    pose, scale = arrays["pose_rad"], float(arrays["action_scale_rad"])
    policy = WalkingPolicy(weights, biases, joints, pose, scale, _gains(arrays))
    _check(policy, str(arrays["activation"]))
    return policy


def _numbered(arrays: dict[str, np.ndarray], kind: str, layers: int) -> tuple[np.ndarray, ...]:
    names = [f"{kind}_{i}" for i in range(layers)]
    for name in names:
        if name not in arrays:
            raise MismatchError(f"{kind} of {layers} layers", f"no {name}")
        _check_array(name, arrays[name], NUMBERS, _AXES[kind])
    return tuple(arrays[name].astype(float) for name in names)


def _check_array(name: str, array: np.ndarray, kinds: str, axes: int) -> None:
    if array.dtype.kind not in kinds or array.ndim != axes:
        wanted = f"{'texts' if kinds == TEXTS else 'numbers'} in {axes} axes as {name}"
        raise MismatchError(wanted, f"{array.dtype} in {array.ndim}")


def _gains(arrays: dict[str, np.ndarray]) -> FollowerGains:
    if _GAINS not in arrays:
        return FollowerGains()
    _check_array(_GAINS, arrays[_GAINS], NUMBERS, 1)
    found = arrays[_GAINS].astype(float).tolist()
    if len(found) != 2 or not all(0 < gain <= LARGEST_GAIN for gain in found):
        wanted = f"two {_GAINS} above 0 and up to {LARGEST_GAIN:g} /s"
        raise MismatchError(wanted, ", ".join(f"{gain:g}" for gain in found) or "none")
    return FollowerGains(kp_speed=found[0], kp_heading=found[1])


def _check(policy: WalkingPolicy, activation: str) -> None:
    if activation != "elu":
        raise MismatchError("activation elu", f"activation {activation}")
    _check_joints(policy, n_actions=_checked_layers(policy))
    if not 0 < policy.action_scale_rad < np.inf:
        raise MismatchError("a finite action_scale_rad above 0", f"{policy.action_scale_rad:g}")


def _checked_layers(policy: WalkingPolicy) -> int:
    """Return the number of actions of a policy whose layers fit each other."""
    size: int = policy.weights[0].shape[-1]
    for i, (W, b) in enumerate(zip(policy.weights, policy.biases, strict=True)):
        if W.shape != (len(b), size):
            raise MismatchError(f"weights_{i} of shape ({len(b)}, {size})", f"{W.shape}")
        if not (np.isfinite(W).all() and np.isfinite(b).all()):
            raise MismatchError("finite numbers", f"NaN or infinity in layer {i}")
        size = len(b)
    return size


def _check_joints(policy: WalkingPolicy, n_actions: int) -> None:
    """Check that each action has a joint of its own, and an angle of the pose."""
    joints, pose_rad = policy.joints, policy.pose_rad
    if n_actions != len(joints) or pose_rad.shape != (n_actions,):
        found = f"{n_actions} actions, {len(joints)} joints"
        raise MismatchError("one action and one angle of the pose per joint", found)
    if len(set(joints)) < n_actions:
        raise MismatchError("distinct joints", f"{n_actions - len(set(joints))} repeated")
    if not np.isfinite(pose_rad).all():
        raise MismatchError("finite angles in pose_rad", "NaN or infinity")
