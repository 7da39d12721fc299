"""The path follower as a network, in spikes or exact.

    b = R(-heading) (e_x, e_y) / reach                       the error seen by the robot
    wz = kp_heading atan2(b_y, b_x), limited                 zero is ahead: there is no wrap
    v = max_speed (|b| + kd_speed |e_v| / max_speed), limited

The host subtracts the state from the reference, so that neurons see bounded errors and no world
coordinates, and takes cosine and sine of the heading. All the rest is in spikes. Angle and length
scale with b as neurons do whose thresholds lie near zero: these decode them best.

Source: paper, sec. 3.2.2; the factorisation in the body frame is ours. The exact law is in
`spikeport.networks.path_following`.
"""

from collections.abc import Callable
from dataclasses import dataclass

import nengo
import numpy as np

from spikeport.networks.held import Held
from spikeport.networks.path_following import (
    COMMAND_SIZE,
    REFERENCE_SIZE,
    STATE_SIZE,
    FollowerGains,
    exact_command,
)
from spikeport.networks.rotation import Squares, rotate

ERROR_SIZE = 6
N_POINTS = 3000
"""Values of b at which its decoders are solved."""
AHEAD_RAD = 1.0
"""Half of these values are within this angle of the heading, where the robot works."""


@dataclass(frozen=True)
class FollowerOptions:
    """Neurons of each part; rates in Hz; time constants in seconds.

    ``n_square`` are those of each of eight squares, ``n_body`` those of b, ``n_velocity`` those of
    the velocity error, and ``n_speed`` those of the forward speed. What squares are biased by
    outweighs their noise: they fire more slowly than the rest.
    """

    n_square: int = 50
    n_body: int = 500
    n_velocity: int = 100
    n_speed: int = 50
    tau_fwd: float = 0.005
    tau_out: float = 0.005
    square_rates: tuple[float, float] = (200.0, 400.0)
    max_rates: tuple[float, float] = (400.0, 800.0)
    tau_ref: float = 0.001
    regularisation: float = 0.03


class FollowerNetwork(nengo.Network):
    """``reference`` and ``state`` are its inputs, ``command`` its output.

    ``reference`` takes planar position (m) and velocity (m/s) of the point to follow, ``state`` the
    robot's heading (rad), planar position (m) and velocity (m/s), all in the world frame;
    ``command`` gives forward speed (m/s) and yaw rate (rad/s).
    """

    reference: nengo.Node
    state: nengo.Node
    command: nengo.Node


def analytic_follower(gains: FollowerGains) -> FollowerNetwork:
    """The path follower without neurons: the exact law, one step late."""

    def law(values: np.ndarray) -> np.ndarray:
        return exact_command(gains, values[:REFERENCE_SIZE], values[REFERENCE_SIZE:])

    net, command = _from_inputs("analytic follower", law, COMMAND_SIZE)
    with net:
        nengo.Connection(command, net.command, synapse=0)  # a step of delay: no algebraic loop
    return net


def path_follower(
    gains: FollowerGains, options: FollowerOptions | None = None, seed: int = 0
) -> FollowerNetwork:
    """Build the spiking network.

    Parameters
    ----------
    gains : FollowerGains
        Gains and limits. Position errors beyond ``gains.reach_m`` are shortened to it, which
        changes no command; velocity errors beyond the largest speed are shortened to that.
    options : FollowerOptions, optional
        Neurons, rates and time constants.
    seed : int
        Seed of neurons and evaluation points.
    """
    options = options or FollowerOptions()
    net, errors = _from_inputs("path follower", _Errors(gains), ERROR_SIZE, seed)
    with net:
        net.config[nengo.Ensemble].max_rates = nengo.dists.Uniform(*options.max_rates)
        net.config[nengo.Ensemble].neuron_type = nengo.LIF(
            tau_ref=options.tau_ref, initial_state={"voltage": nengo.dists.Choice([0])}
        )
        net.config[nengo.Connection].solver = nengo.solvers.LstsqL2(reg=options.regularisation)
        body = _vector("body", options.n_body, _positions(seed))
        squares = Squares(options.n_square, options.square_rates, options.tau_fwd)
        rotate(errors[:4], body, squares)
        velocity = _vector("velocity", options.n_velocity, nengo.dists.UniformHypersphere())
        nengo.Connection(errors[4:], velocity, synapse=None)
        _yaw_rate(body, net.command[1], gains, options)
        _speed({body: 1.0, velocity: gains.kd_speed}, net.command[0], gains, options)
    return net


class _Errors:
    """What the host shows to the neurons: [position error, cos, sin, velocity error]."""

    def __init__(self, gains: FollowerGains) -> None:
        self._reach_m = gains.reach_m
        self._fastest_m_s = gains.max_speed_m_s

    def __call__(self, values: np.ndarray) -> np.ndarray:
        heading, motion = values[REFERENCE_SIZE], values[REFERENCE_SIZE + 1 :]
        position, velocity = np.split(values[:REFERENCE_SIZE] - motion, 2)
        turn = np.cos(heading), np.sin(heading)
        return np.concatenate(
            (_share(position, self._reach_m), turn, _share(velocity, self._fastest_m_s))
        )


def _share(vector: np.ndarray, limit: float) -> np.ndarray:
    """The vector in units of a limit, and no longer than it."""
    return vector / max(limit, float(np.hypot(*vector)))


def _from_inputs(
    label: str, function: Callable[[np.ndarray], np.ndarray], size: int, seed: int = 0
) -> tuple[FollowerNetwork, nengo.Node]:
    """A network with inputs and output, and a node that computes a function of all inputs."""
    with FollowerNetwork(label=label, seed=seed) as net:
        net.reference = nengo.Node(size_in=REFERENCE_SIZE, label="reference")
        net.state = nengo.Node(size_in=STATE_SIZE, label="state")
        net.command = nengo.Node(size_in=COMMAND_SIZE, label="command")
        computed = nengo.Node(
            Held(function), size_in=REFERENCE_SIZE + STATE_SIZE, size_out=size, label="from inputs"
        )
        nengo.Connection(net.reference, computed[:REFERENCE_SIZE], synapse=None)
        nengo.Connection(net.state, computed[REFERENCE_SIZE:], synapse=None)
    return net, computed


def _vector(
    label: str, n_neurons: int, points: np.ndarray | nengo.dists.Distribution
) -> nengo.Ensemble:
    """Neurons of a vector of which length and angle are decoded."""
    near_zero = nengo.dists.Uniform(-0.1, 0.1)
    return nengo.Ensemble(n_neurons, 2, intercepts=near_zero, eval_points=points, label=label)


def _positions(seed: int) -> np.ndarray:
    """(n, 2) values of b: even in the unit disc, and as many ahead again."""
    rng = np.random.RandomState(seed)
    angle = rng.uniform(-np.pi, np.pi, N_POINTS)
    angle[: N_POINTS // 2] *= AHEAD_RAD / np.pi
    length = np.sqrt(rng.uniform(0, 1, N_POINTS))
    return length[:, np.newaxis] * np.stack((np.cos(angle), np.sin(angle)), axis=1)


def _yaw_rate(
    body: nengo.Ensemble, command: nengo.Node, gains: FollowerGains, options: FollowerOptions
) -> None:
    nengo.Connection(
        body,
        command,
        function=lambda b: gains.yaw_rate(np.arctan2(b[1], b[0])),
        synapse=options.tau_out,
    )


def _speed(
    errors: dict[nengo.Ensemble, float],
    command: nengo.Node,
    gains: FollowerGains,
    options: FollowerOptions,
) -> None:
    """Add the lengths of weighted errors, and limit the sum, as shares of the largest speed."""
    n = options.n_speed
    wanted = nengo.Ensemble(
        n,
        1,
        radius=sum(errors.values()),
        encoders=np.ones((n, 1)),
        intercepts=np.linspace(0, 0.95, n),
        eval_points=np.linspace(0, 1, N_POINTS)[:, np.newaxis],
        label="speed",
    )
    for vector, gain in errors.items():
        nengo.Connection(
            vector,
            wanted,
            function=lambda e: np.hypot(*e),
            transform=gain,
            synapse=options.tau_fwd,
        )
    nengo.Connection(
        wanted,
        command,
        function=lambda u: gains.speed(gains.reach_m * u, 0.0),
        synapse=options.tau_out,
    )
