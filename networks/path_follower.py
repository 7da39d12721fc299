"""The path follower as a network, in spikes or exact.

    b = R(-heading) (e_x, e_y) / reach                       the error in the robot's frame
    wz = kp_heading atan2(b_y, b_x), limited                 zero is ahead: there is no wrap
    v = max_speed (|e| / reach + kd_speed |e_v| / max_speed), limited

The host subtracts the state from the reference, so that neurons see bounded errors and no world
coordinates, and takes cosine and sine of the heading. The rest is in spikes.

Source: paper, sec. 3.2.2; the factorisation in the body frame is ours. The exact law is in
`spikeport.networks.path_following`.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import nengo
import numpy as np

from spikeport.networks.analytic_follower import FollowerNetwork, analytic_follower, from_inputs
from spikeport.networks.at_rest import at_rest
from spikeport.networks.option_checks import (
    check_counts,
    check_filters,
    check_pairs,
    check_rates,
)
from spikeport.networks.path_following import FollowerGains
from spikeport.networks.plane_vectors import N_POINTS, bearing_ensemble, length_ensemble
from spikeport.networks.rotation import Squares, rotate

__all__ = ["FollowerNetwork", "FollowerOptions", "analytic_follower", "path_follower"]

ERROR_SIZE = 6
TAU_HOST_S = 0.005
"""Filter of values from the host, at neurons on the chip."""
AHEAD = 1.5
"""Most of the bearing's neurons are for angles up to AHEAD times that of the largest yaw rate."""


@dataclass(frozen=True)
class FollowerOptions:
    """Neurons of each part; rates in Hz; time constants in seconds.

    ``n_square`` neurons compute each of eight squares; ``n_bearing`` represent b, ``n_distance``
    and ``n_velocity`` the position and velocity errors, and ``n_speed`` the forward speed.
    The intervals between spikes on the chip are whole steps, so that slow neurons have finer rates,
    but more noise. The bearing's neurons are fast, since their noise is noise of the yaw rate.
    Their input has a long filter, since noise there makes the robot turn less than commanded; the
    command has one, too, since its slow noise throws the robot off its path.
    """

    n_square: int = 140
    n_bearing: int = 280
    n_distance: int = 200
    n_velocity: int = 100
    n_speed: int = 50
    tau_fwd: float = 0.02
    tau_out: float = 0.03
    rates: tuple[float, float] = (100.0, 200.0)
    bearing_rates: tuple[float, float] = (400.0, 800.0)
    tau_ref: float = 0.001
    regularisation: float = 0.01
    bearing_regularisation: float = 0.02

    def __post_init__(self) -> None:
        """Check the values; UsageError says what is wrong."""
        check_counts(
            n_distance=self.n_distance,
            n_velocity=self.n_velocity,
            n_speed=self.n_speed,
        )
        check_pairs("n_square", self.n_square, "a square")
        check_pairs("n_bearing", self.n_bearing, "the bearing")
        check_filters(tau_fwd=self.tau_fwd, tau_out=self.tau_out)
        check_rates(rates=self.rates, bearing_rates=self.bearing_rates)


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
    net, errors = from_inputs("path follower", _Errors(gains), ERROR_SIZE, seed)
    with net:
        net.config[nengo.Ensemble].max_rates = nengo.dists.Uniform(*options.rates)
        net.config[nengo.Ensemble].neuron_type = nengo.LIF(
            tau_ref=options.tau_ref, initial_state=at_rest()
        )
        net.config[nengo.Connection].solver = nengo.solvers.LstsqL2(reg=options.regularisation)
        body = _yaw_rate(errors[:4], net.command[1], gains, options)
        distance = length_ensemble("distance", options.n_distance)
        velocity = length_ensemble("velocity", options.n_velocity)
        nengo.Connection(errors[:2], distance, synapse=None)
        nengo.Connection(errors[4:], velocity, synapse=None)
        lengths = {distance: 1.0, velocity: gains.kd_speed}
        inner = [body, _speed(lengths, net.command[0], gains, options)]
    # A compartment has one filter: a gate needs that of the neurons' other inputs.
    outer = [ensemble for ensemble in net.ensembles if ensemble not in inner]
    net.filters = {TAU_HOST_S: outer}
    net.filters.setdefault(options.tau_fwd, []).extend(inner)
    return net


class _Errors:
    """The values that the host sends to the neurons: [position error, cos, sin, velocity error]."""

    def __init__(self, gains: FollowerGains) -> None:
        self._reach_m = gains.reach_m
        self._fastest_m_s = gains.max_speed_m_s

    def __call__(self, values: np.ndarray) -> np.ndarray:
        # Plain numbers, which are faster than arrays of two.
        to_x, to_y, to_vx, to_vy, heading, x, y, vx, vy = values.tolist()
        error = _share(to_x - x, to_y - y, self._reach_m)
        slip = _share(to_vx - vx, to_vy - vy, self._fastest_m_s)
        return np.array((*error, np.cos(heading), np.sin(heading), *slip))


def _share(x: float, y: float, limit: float) -> tuple[float, float]:
    """Return the vector in units of a limit, shortened to length 1 if it is longer."""
    # Both components are scaled alike, to keep the direction: the bearing is decoded from it.
    unit = max(limit, float(np.hypot(x, y)))
    return x / unit, y / unit


def _yaw_rate(
    vector_and_angle: nengo.Node,
    command: nengo.Node,
    gains: FollowerGains,
    options: FollowerOptions,
) -> nengo.Ensemble:
    """Turn the error into the body frame, and decode the yaw rate from its bearing."""
    ahead_rad = AHEAD * gains.max_yaw_rate_rad_s / gains.kp_heading
    body = bearing_ensemble("body", options.n_bearing, options.bearing_rates, ahead_rad)
    rotate(vector_and_angle, body, Squares(options.n_square, options.rates, options.tau_fwd))
    nengo.Connection(
        body,
        command,
        # Zero is ahead, so that the angle's jump lies behind the robot, where the limit holds.
        function=lambda b: gains.yaw_rate(np.arctan2(b[1], b[0])),
        solver=nengo.solvers.LstsqL2(reg=options.bearing_regularisation),
        synapse=options.tau_out,
    )
    return body


def _speed(
    errors: Mapping[nengo.Ensemble, float],
    command: nengo.Node,
    gains: FollowerGains,
    options: FollowerOptions,
) -> nengo.Ensemble:
    """Add the lengths of weighted errors, and limit the sum, as shares of the largest speed."""
    n = options.n_speed
    wanted = nengo.Ensemble(
        n,
        1,
        radius=sum(errors.values()),
        # Lengths are never negative: neurons for negative values would never fire.
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
    return wanted
