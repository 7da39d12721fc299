"""A second referee: brian2-loihi, an emulator that was checked against the chip by other people.

Michaelis, Lehr, Oed and Tetzlaff (2022), Brian2Loihi, Frontiers in Neuroinformatics 16. Its neuron

    I <- I - sign(I) ceil(|I| decay_I / 4096) + weights
    v <- v - sign(v) ceil(|v| decay_v / 4096) + I

rounds the lost part away from zero, and so the rest towards zero, as nengo-loihi does. There is one
difference: nengo-loihi says that the chip adds 1 to the current's decay, and its discretiser
subtracts that 1. So ``decay_u`` of an image is ``decay_I - 1``.
"""

import contextlib
import importlib
import itertools
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import pytest

from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.oracle import Oracle
from tests.helpers.side_by_side import assert_equal_steps

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning:pyparsing|brian2")

N_STEPS, N_INPUTS = 600, 12


class Neurons(NamedTuple):
    """A group of neurons, in brian2-loihi's terms."""

    n: int
    refractory: int
    threshold_v_mant: int
    decay_v: int
    decay_I: int  # noqa: N815, brian2-loihi's name


GROUPS = (Neurons(30, 1, 500, 128, 400), Neurons(25, 5, 250, 3, 2049), Neurons(9, 64, 90, 4095, 1))


FIRST = np.cumsum([0] + [group.n for group in GROUPS])


class Run(NamedTuple):
    """The records of neurons: (n_steps, n) each."""

    spiked: np.ndarray
    v: np.ndarray
    u: np.ndarray


class Weights(NamedTuple):
    """Mantissas of synapses into a group, from its input and from all neurons; 0 for none."""

    from_input: np.ndarray
    from_all: np.ndarray


@contextlib.contextmanager
def with_ptp() -> Iterator[None]:
    """Give arrays the method ``ptp``, which brian2 2.9 names and NumPy 2 removed."""
    real = np.ndarray
    if hasattr(real, "ptp"):
        yield
        return
    for name in ("numpy.random", "matplotlib.pylab", "sympy"):  # they must see the real one
        with contextlib.suppress(ImportError):
            importlib.import_module(name)

    class WithPtp(real):
        ptp = np.ptp

    np.ndarray = WithPtp
    try:
        yield
    finally:
        np.ndarray = real


@pytest.fixture(scope="module")
def brian() -> Any:
    """Import brian2-loihi, without compilers."""
    with with_ptp():
        brian2 = pytest.importorskip("brian2", reason="brian2 is not installed")
        package = pytest.importorskip("brian2_loihi", reason="brian2-loihi is not installed")
    brian2.prefs.codegen.target = "numpy"
    return package


@pytest.fixture(scope="module")
def weights() -> list[Weights]:
    """Return sparse mixed weights: even mantissas, since a mixed sign costs a bit."""
    rng = np.random.RandomState(6)
    n_all = FIRST[-1]
    return [
        Weights(
            sparse(rng, (N_INPUTS, g.n), 0.4, -40, 100), sparse(rng, (n_all, g.n), 0.1, -90, 90)
        )
        for g in GROUPS
    ]


def sparse(
    rng: np.random.RandomState, shape: tuple[int, int], density: float, low: int, high: int
) -> np.ndarray:
    return 2 * rng.randint(low, high, size=shape) * (rng.rand(*shape) < density)


@pytest.fixture(scope="module")
def inputs() -> np.ndarray:
    """Return (N_STEPS, N_INPUTS) input spikes, with pauses and bursts."""
    rng = np.random.RandomState(7)
    rate = np.repeat(rng.choice([0, 0.05, 0.4], size=N_STEPS // 50), 50)
    spikes = rng.rand(N_STEPS, N_INPUTS) < rate[:, np.newaxis]
    spikes[0] = False  # brian2's first step has number 0: no step before it to send them
    return spikes


def run_brian(brian: Any, weights: list[Weights], inputs: np.ndarray) -> Run:
    groups = [brian.LoihiNeuronGroup(g.n, *g[1:]) for g in GROUPS]
    times, sources = np.nonzero(inputs)
    source = brian.LoihiSpikeGeneratorGroup(N_INPUTS, sources, times)
    synapses = [
        connect(brian, pre, post, mantissas)
        for post, into in zip(groups, weights, strict=True)
        for pre, mantissas in zip([source, *groups], [into.from_input, *split(into)], strict=True)
    ]
    spikes = [brian.LoihiSpikeMonitor(g) for g in groups]
    v, current = ([brian.LoihiStateMonitor(g, name) for g in groups] for name in ("v", "I"))
    brian.LoihiNetwork(source, *groups, *synapses, *spikes, *v, *current).run(N_STEPS)
    return Run(
        spiked=np.hstack([raster(monitor, g.n) for monitor, g in zip(spikes, GROUPS, strict=True)]),
        v=np.vstack([monitor.v for monitor in v]).T,
        u=np.vstack([monitor.I for monitor in current]).T,
    )


def split(into: Weights) -> list[np.ndarray]:
    """Return the weights from all neurons, group by group."""
    return np.split(into.from_all, FIRST[1:-1])


def raster(monitor: Any, n: int) -> np.ndarray:
    spiked = np.zeros((N_STEPS, n), dtype=bool)
    spiked[monitor.t, np.array(monitor.i)] = True
    return spiked


def connect(brian: Any, pre: Any, post: Any, mantissas: np.ndarray) -> Any:
    synapses = brian.LoihiSynapses(pre, post, sign_mode=brian.synapse_sign_mode.MIXED)
    i, j = np.nonzero(mantissas)
    synapses.connect(i=i, j=j)
    synapses.w = mantissas[i, j]
    return synapses


def chip_image(weights: list[Weights], decay_u_offset: int) -> ChipImage:
    """Return an image of the same network, with each group of neurons a block on its own core."""
    blocks = [
        Block(
            n=g.n,
            core=core,
            decay_u=g.decay_I - decay_u_offset,
            decay_v=g.decay_v,
            vth=g.threshold_v_mant * 64,
            refract_delay=g.refractory,
        )
        for core, g in enumerate(GROUPS)
    ]
    groups, routes = [], []
    for number, into in enumerate(weights):
        groups += [rows(into.from_input, number), rows(into.from_all, number)]
        routes.append(Route(axon=range(N_INPUTS), input=0, group=2 * number))
        routes += [
            Route(axon=range(FIRST[i], FIRST[i + 1]), block=i, group=2 * number + 1)
            for i in range(len(GROUPS))
        ]
    return Parts(blocks, groups, [N_INPUTS], routes).image()


def rows(mantissas: np.ndarray, block: int) -> Group:
    targets = [np.flatnonzero(row) for row in mantissas]
    weights = [row[t] * 64 for row, t in zip(mantissas, targets, strict=True)]
    return Group(weights=weights, indices=targets, block=block)


def host_spikes(inputs: np.ndarray) -> list[np.ndarray]:
    """Shift by a step: brian2-loihi delivers a spike in its own step, a chip in the next one."""
    return [np.flatnonzero(row) for row in [*inputs[1:], np.zeros(N_INPUTS)]]


@pytest.fixture(scope="module")
def theirs(brian: Any, weights: list[Weights], inputs: np.ndarray) -> Run:
    return run_brian(brian, weights, inputs)


@pytest.mark.slow
def test_the_network_is_worth_comparing(theirs: Run) -> None:
    """Every group spikes, and some of their currents and voltages turn negative."""
    for a, b in itertools.pairwise(FIRST):
        assert theirs.spiked[:, a:b].sum() > 30
        assert theirs.u[:, a:b].min() < 0 < theirs.u[:, a:b].max()
    assert theirs.v.min() > -(2**23)


@pytest.mark.slow
def test_the_native_backend_is_equal_to_brian2_loihi(
    theirs: Run, weights: list[Weights], inputs: np.ndarray
) -> None:
    image = chip_image(weights, decay_u_offset=1)
    states = assert_equal_steps(image, 0, host_spikes(inputs))
    for step, state in enumerate(states):
        np.testing.assert_array_equal(state.spiked, theirs.spiked[step], err_msg=f"step {step}")
        np.testing.assert_array_equal(state.u, theirs.u[step], err_msg=f"step {step}")
        np.testing.assert_array_equal(state.v, theirs.v[step], err_msg=f"step {step}")


class OracleWithoutOffset(Oracle):
    """The oracle with brian2-loihi's rule for the decay of the current."""

    offset_u = 0


@pytest.mark.slow
def test_the_offset_of_the_decay_is_the_only_difference(
    theirs: Run, weights: list[Weights], inputs: np.ndarray
) -> None:
    image = chip_image(weights, decay_u_offset=0)
    same, native = OracleWithoutOffset(image, 0), NativeChip(image, 0)
    differs = False
    for step, spikes in enumerate(host_spikes(inputs)):
        same.step(spikes, {})
        native.step(spikes, {})
        for name in ("spiked", "u", "v"):
            np.testing.assert_array_equal(
                getattr(same, name), getattr(theirs, name)[step], err_msg=f"{name}, step {step}"
            )
        differs |= bool(np.any(native.state.u != theirs.u[step]))
    assert differs
