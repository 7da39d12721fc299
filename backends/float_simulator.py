"""A network on Nengo's own simulator, for `Reference` and for the loss against float."""

import nengo

from spikeport.backends.generators import own_generators
from spikeport.compile.ground.refusal import refused_in_float
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.loihi.events import own_event_reader


def float_simulator(
    rewrite: Rewrite,
    dt_s: float,
    seed: int,
    optimize: bool,
    beside_chip: bool = False,
    model: nengo.builder.Model | None = None,
) -> nengo.Simulator:
    """Return the simulator of a network, with the gains, encoders and decoders of its compile.

    Parameters
    ----------
    rewrite : Rewrite
        The network, with the seeds of its objects.
    dt_s : float
        The time step, in seconds.
    seed : int
        Seed of processes and noise.
    optimize : bool
        Merge operators, so that a step takes a fraction of the time. Their order differs from run
        to run, and with it the rounding of sums; if False, a run depends on its seeds alone.
    beside_chip : bool
        The chip is compared with it, and can also run alone, as a refusal says.
    model : nengo.builder.Model, optional
        The model of an earlier simulator, which is not built anew.

    Raises
    ------
    RefusedError
        If Nengo refuses the network.
    """
    # Nengo-loihi's own reader of event files fails with NumPy 2.
    with own_event_reader(), refused_in_float(beside_chip):
        if model is None:
            model = nengo.builder.Model(dt=dt_s)
            model.seeds.update(rewrite.all_seeds())
            model.seeded[rewrite.network] = True
            model.build(rewrite.network)
        with own_generators(model):
            return nengo.Simulator(
                None, dt=dt_s, seed=seed, model=model, progress_bar=False, optimize=optimize
            )
