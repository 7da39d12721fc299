"""Spiking control of the right arm: S1, M1 and CB, factored as in the paper (sec. 3.1).

- S1 relays the state [q, dq, x]: 50 neurons for each of its 11 dimensions. They are one ensemble
  with axis-aligned encoders, decoded dimension by dimension. This computes the same as eleven
  ensembles, on a quarter of the cores.
- M1 has one 5-D ensemble [q, e_d] per axis d, decoding kp e_d f_d(q).
- CB has one 5-D ensemble [q, dq_j] per joint j, decoding -kv dq_j M_j(q), and a 4-D ensemble [q]
  decoding gravity and posture.
- With an efference copy CB learns, too (`_Builder.efference_copy`). The paper mentions the copy,
  but has no equation that uses it.

Values are normalised to the region the task needs (`spikeport.networks.region`). Decoded
torques are divided by their full scale, and multiplied again on their way to the torque node, on
the host: a read-out on the chip saturates, silently, at a value of 10.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import nengo
import numpy as np

from spikeport.networks.at_rest import at_rest
from spikeport.networks.operational_space import LawTerms, OperationalSpaceLaw
from spikeport.networks.region import ArmRegion, Box
from spikeport.networks.solvers import PerDimension
from spikeport.node_functions import Held

AXES = ("x", "y", "z")
JOINTS = ("pitch", "roll", "yaw", "elbow")
STATE_SIZE = 11
RASTER_NEURONS = 60
"""Neurons of each M1 axis whose spikes are probed."""
REGULARISATION = 0.05
"""Regularisation of the torques' decoders (see `nengo.solvers.LstsqL2`)."""
LEARNING_RATE = 1e-4
"""Learning rate of CB's part that learns (see `nengo.PES`)."""
MAX_DECODED_NEURONS = 4000
"""The most neurons of a decoded ensemble: a relay on the chip has 4,096 input axons."""


@dataclass(frozen=True)
class ArmSizes:
    """Neurons per M1 axis, per CB ensemble, and per S1 dimension."""

    m1: int = 1000
    cb: int = 200
    s1: int = 50

    @property
    def total(self) -> int:
        """The number of neurons in the whole controller, without an efference copy's."""
        return 3 * self.m1 + 5 * self.cb + STATE_SIZE * self.s1

    @property
    def decoders(self) -> dict[str, tuple[int, int]]:
        """The shapes of the decoders of each term of the torque, by the group that decodes it."""
        m1 = {f"M1 {axis}": (self.m1, len(JOINTS)) for axis in AXES}
        cb = {f"CB {term}": (self.cb, len(JOINTS)) for term in (*JOINTS, "gravity")}
        return m1 | cb


PRESETS = {"paper": ArmSizes(m1=8000), "lean": ArmSizes(m1=1000)}


@dataclass(frozen=True)
class ArmSynapses:
    """Low-pass time constants in seconds: from S1 to M1 and CB, and of the torque."""

    relay_s: float = 0.005
    torque_s: float = 0.010


class ArmNetwork(nengo.Network):
    """The controller. ``state`` [q, dq, x] and ``target`` are its inputs, ``torque`` its output.

    ``state`` takes joint angles (rad), joint velocities (rad/s) and the hand's position (m);
    ``target`` the position (m) to reach; ``torque`` gives the four joint torques in N m.
    ``rasters`` holds, for each axis of M1, a probe of the spikes of some of its neurons; ``groups``
    the ensembles that decode each term of the torque (`term_torques`).
    """

    state: nengo.Node
    target: nengo.Node
    torque: nengo.Node
    rasters: dict[str, nengo.Probe]
    groups: dict[str, list[nengo.Ensemble]]


def term_torques(terms: LawTerms, dq: np.ndarray, error: np.ndarray) -> dict[str, np.ndarray]:
    """Return the terms whose sum is the torque: (n, 4) in N m each, by the group that decodes it.

    Parameters
    ----------
    terms : LawTerms
        The law's terms at n postures.
    dq, error : (n, 4) and (n, 3) arrays
        Joint velocities in rad/s and position errors in m.
    """
    kinematic = {f"M1 {axis}": terms.kinematic[:, d] * error[:, [d]] for d, axis in enumerate(AXES)}
    damping = {f"CB {joint}": terms.damping[:, j] * dq[:, [j]] for j, joint in enumerate(JOINTS)}
    return {**kinematic, **damping, "CB gravity": terms.bias}


def arm(
    law: OperationalSpaceLaw,
    region: ArmRegion,
    sizes: ArmSizes | None = None,
    synapses: ArmSynapses | None = None,
    seed: int = 0,
    decoders: Mapping[str, np.ndarray] | None = None,
    efference_copy: bool = False,
) -> ArmNetwork:
    """Build the spiking controller.

    Parameters
    ----------
    law : OperationalSpaceLaw
        The law that the network decodes.
    region : ArmRegion
        The states that the network is made for.
    sizes, synapses : optional
        Neuron counts and time constants.
    seed : int
        Seed of neurons and evaluation points.
    decoders : mapping of str to (n, 4) array, optional
        Decoders of each group of ``groups``, in N m per Hz, instead of those solved for float
        neurons.
    efference_copy : bool
        Let CB learn from a copy of M1's torque.
    """
    net = ArmNetwork(label="arm", seed=seed)
    build = _Builder(
        net, law, region, sizes or ArmSizes(), synapses or ArmSynapses(), seed, decoders or {}
    )
    with net:
        net.config[nengo.Ensemble].max_rates = nengo.dists.Uniform(200, 400)
        net.config[nengo.Ensemble].neuron_type = nengo.LIF(initial_state=at_rest())
        net.rasters, net.groups = {}, {}
        build.inputs()
        build.s1()
        build.torque()
        build.m1()
        build.cb()
        if efference_copy:
            build.efference_copy()
    return net


class _Builder:
    """Builder of an `ArmNetwork`, with a method for each part."""

    def __init__(
        self,
        net: ArmNetwork,
        law: OperationalSpaceLaw,
        region: ArmRegion,
        sizes: ArmSizes,
        synapses: ArmSynapses,
        seed: int,
        decoders: Mapping[str, np.ndarray],
    ) -> None:
        self.net = net
        self.region = region
        self.sizes = sizes
        self.synapses = synapses
        self.decoders = decoders
        self.q = region.q.normalise(region.q_samples)
        # A group has one error or velocity besides the posture: all groups use one random scalar.
        self.scalar = np.random.RandomState(seed).uniform(-1, 1, (len(self.q), 1))
        self.targets = term_torques(
            law.terms(region.q_samples),
            self.scalar * region.dq.half,
            self.scalar * region.error.half,
        )
        self.scales = {label: np.abs(t).max(axis=0) for label, t in self.targets.items()}

    def inputs(self) -> None:
        """Normalise the inputs in one node: each node costs the host a Python call."""
        region, net = self.region, self.net
        box = Box.join(region.q, region.dq, region.x, region.x)
        with nengo.Network(label="inputs"):
            net.state = nengo.Node(size_in=STATE_SIZE, label="state")
            net.target = nengo.Node(size_in=3, label="target")
            whole = nengo.Node(
                Held(box.normalise),
                size_in=STATE_SIZE + 3,
                size_out=STATE_SIZE + 3,
                label="normalised",
            )
            nengo.Connection(net.state, whole[:STATE_SIZE], synapse=None)
            nengo.Connection(net.target, whole[STATE_SIZE:], synapse=None)
        self.state, self.target = whole[:STATE_SIZE], whole[STATE_SIZE:]

    def s1(self) -> None:
        """Relay the state, by default with 50 neurons for each dimension.

        Their intercepts are evenly spaced, in pairs of both signs: so few random ones would leave
        gaps, and an error there is an error of the hand's position.
        """
        n = self.sizes.s1
        signs = np.where(np.arange(STATE_SIZE * n) % 2, 1.0, -1.0)
        encoders = np.repeat(np.eye(STATE_SIZE), n, axis=0) * signs[:, np.newaxis]
        pairs = -(-n // 2)
        # Up to 0.9, as in Nengo: a neuron with a higher intercept fires at few values.
        intercepts = np.repeat(-1 + 1.9 * (np.arange(pairs) + 0.5) / pairs, 2)[:n]
        self.s1_ensemble = nengo.Ensemble(
            STATE_SIZE * n,
            STATE_SIZE,
            encoders=encoders,
            intercepts=np.tile(intercepts, STATE_SIZE),
            eval_points=nengo.dists.Uniform(-1, 1),
            n_eval_points=2000,
            label="S1",
        )
        nengo.Connection(self.state, self.s1_ensemble, synapse=None)

    def torque(self) -> None:
        """Sum the decoded torques, each times its full scale."""
        with nengo.Network(label="torques"):
            self.shares = nengo.Node(size_in=4 * len(self.scales), label="shares")
            self.net.torque = nengo.Node(size_in=4, label="torque")
            for i, scale in enumerate(self.scales.values()):
                share = self.shares[4 * i : 4 * i + 4]
                nengo.Connection(share, self.net.torque, transform=scale, synapse=None)

    def m1(self) -> None:
        """Build a 5-D group [q, e_d] for each axis."""
        region = self.region
        # Positions are in units of their box; M1 represents errors in units of the errors' box.
        per_error = region.x.half / region.error.half
        for d, axis in enumerate(AXES):
            feedback = _select(4, {8 + d: -per_error[d]})
            group = self._term(f"M1 {axis}", self.sizes.m1, feedback)
            target = np.zeros((5, 3))
            target[4, d] = per_error[d]
            for ensemble in group:
                nengo.Connection(self.target, ensemble, transform=target, synapse=None)
            self.net.rasters[axis] = nengo.Probe(group[0].neurons[:RASTER_NEURONS])

    def cb(self) -> None:
        """Build a 5-D group [q, dq_j] for each joint, and a 4-D one [q] for gravity and posture."""
        for j, joint in enumerate(JOINTS):
            self._term(f"CB {joint}", self.sizes.cb, _select(4, {4 + j: 1.0}))
        self._term("CB gravity", self.sizes.cb, _select(4))

    def efference_copy(self) -> None:
        """Let CB add a torque that it learns, until M1 has nothing left to correct on average.

            u_learned = D^T a(q, dq)    dD/dt = rate a(q, dq) u_kin^T

        ``a`` (n,) are activities of neurons that represent [q, dq], ``u_kin`` (4,) is the copy of
        M1's torque. Source: DeWolf, Stewart, Slotine, Eliasmith, "A spiking neural model of
        adaptive arm control", Proc. R. Soc. B 283, 2016. In that paper CB learns the
        dynamics that the arm's model lacks.
        """
        # In a network of their own, these objects leave the seeds of all others unchanged.
        with nengo.Network(label="CB learned"):
            learner = nengo.Ensemble(
                self.sizes.cb, 2 * len(JOINTS), radius=np.sqrt(len(JOINTS)), label="CB learned"
            )
            learned = nengo.Node(size_in=len(JOINTS), label="learned")
        nengo.Connection(
            self.s1_ensemble,
            learner,
            transform=_select(2 * len(JOINTS)),
            solver=PerDimension(self.sizes.s1),
            synapse=self.synapses.relay_s,
        )
        decoded = nengo.Connection(
            learner,
            learned,
            function=_nothing,
            learning_rule_type=nengo.PES(LEARNING_RATE),
            synapse=self.synapses.torque_s,
        )
        scales = [self.scales[f"M1 {axis}"] for axis in AXES]
        # In units of the largest torque that M1 asks for, errors stay below 1; the chip clips them
        # at 1.27.
        unit = np.sum(scales, axis=0)
        nengo.Connection(learned, self.net.torque, transform=unit, synapse=None)
        for i, scale in enumerate(scales):
            copy = self.shares[4 * i : 4 * i + 4]
            # PES expects decoded minus target; M1's torque is the missing part, hence the sign.
            nengo.Connection(copy, decoded.learning_rule, transform=-scale / unit, synapse=None)

    def _term(self, label: str, n: int, transform: np.ndarray) -> list[nengo.Ensemble]:
        """Return ensembles that decode a term of the torque from a transform of S1's state."""
        dimensions = len(transform)
        points = np.hstack([self.q, self.scalar])[:, :dimensions]
        parts = -(-n // MAX_DECODED_NEURONS)
        group = self.net.groups[label] = []
        for part in range(parts):
            neurons = slice(n * part // parts, n * (part + 1) // parts)
            ensemble = nengo.Ensemble(
                neurons.stop - neurons.start,
                dimensions,
                radius=1.2,
                intercepts=nengo.dists.Uniform(-1, 0.9),
                eval_points=points,
                label=label if parts == 1 else f"{label} {part + 1}",
            )
            nengo.Connection(
                self.s1_ensemble,
                ensemble,
                transform=transform,
                solver=PerDimension(self.sizes.s1),
                synapse=self.synapses.relay_s,
            )
            self._decode(ensemble, points, label, neurons, parts)
            group.append(ensemble)
        return group

    def _decode(
        self,
        ensemble: nengo.Ensemble,
        points: np.ndarray,
        label: str,
        neurons: slice,
        parts: int,
    ) -> None:
        """Decode the share of a term of the torque that one of the parts of its group has."""
        scale = self.scales[label]
        column = 4 * list(self.scales).index(label)
        nengo.Connection(
            ensemble,
            self.shares[column : column + 4],
            function=self.targets[label] / scale / parts,
            eval_points=points,
            scale_eval_points=False,
            solver=self._solver(label, neurons, scale),
            synapse=self.synapses.torque_s,
        )

    def _solver(self, label: str, neurons: slice, scale: np.ndarray) -> nengo.solvers.Solver:
        """Return the solver of the decoders of some neurons of a group."""
        if label in self.decoders:
            return nengo.solvers.NoSolver(self.decoders[label][neurons] / scale)
        return nengo.solvers.LstsqL2(reg=REGULARISATION)


def _nothing(_state: np.ndarray) -> np.ndarray:
    """Return the decoded torque before anything is learned: zeros, (4,)."""
    return np.zeros(len(JOINTS))


def _select(n_first: int, extra: dict[int, float] | None = None) -> np.ndarray:
    """Return rows that pick the state's first values, and a row with the weights ``extra``."""
    rows = np.eye(STATE_SIZE)[:n_first]
    if extra is None:
        return rows
    last = np.zeros((1, STATE_SIZE))
    for column, weight in extra.items():
        last[0, column] = weight
    return np.vstack([rows, last])


def analytic_arm(law: OperationalSpaceLaw) -> ArmNetwork:
    """Return the controller without neurons: the exact law, one step late."""
    net = ArmNetwork(label="analytic arm")
    with net:
        net.state = nengo.Node(size_in=STATE_SIZE, label="state")
        net.target = nengo.Node(size_in=3, label="target")
        exact = nengo.Node(Held(_exact(law)), size_in=STATE_SIZE + 3, size_out=4, label="law")
        net.torque = nengo.Node(size_in=4, label="torque")
        nengo.Connection(net.state, exact[:STATE_SIZE], synapse=None)
        nengo.Connection(net.target, exact[STATE_SIZE:], synapse=None)
        nengo.Connection(exact, net.torque, synapse=0)  # a step of delay: no algebraic loop
        net.rasters, net.groups = {}, {}
    return net


def _exact(law: OperationalSpaceLaw) -> Callable[[np.ndarray], np.ndarray]:
    def torque(values: np.ndarray) -> np.ndarray:
        q, dq, x, target = values[:4], values[4:8], values[8:11], values[11:]
        return law.torque(q, dq, target - x)

    return torque
