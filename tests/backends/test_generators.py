"""Random numbers of neurons on the host: the same in each run of a built model."""

import nengo
import numpy as np
import pytest
from nengo.builder import Model

import spikeport
from spikeport.backends.generators import own_generators


def stochastic() -> nengo.Network:
    """Return an ensemble on the host that draws random numbers, and one on the chip."""
    with nengo.Network(seed=1) as network:
        spikeport.add_params(network)
        kinds = nengo.PoissonSpiking(nengo.LIFRate()), nengo.StochasticSpiking(nengo.LIFRate())
        for kind in kinds:
            ensemble = nengo.Ensemble(30, 1, neuron_type=kind)
            network.config[ensemble].on_chip = False
            nengo.Probe(ensemble.neurons)
        nengo.Connection(ensemble, nengo.Ensemble(20, 1))
    return network


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("backend", ["native", "reference"])
def test_a_reset_restarts_the_random_numbers_of_host_neurons(backend: str) -> None:
    network, runs = stochastic(), []
    with spikeport.Simulator(network, backend=backend) as simulator:
        for _ in range(3):
            simulator.run_steps(50)
            runs.append([simulator.data[probe] for probe in network.all_probes])
            simulator.reset()
    for probe in range(len(network.all_probes)):
        first, second, third = (run[probe] for run in runs)
        assert first.any()
        assert np.array_equal(first, second)
        assert np.array_equal(first, third)


def test_a_run_leaves_the_random_generators_of_its_model_unchanged() -> None:
    model = Model()
    model.build(stochastic())
    generators = [one for op in model.operators for one in vars(op).get("state_extra", {}).values()]
    before = [generator.get_state()[2] for generator in generators]
    with own_generators(model), nengo.Simulator(None, model=model, progress_bar=False) as simulator:
        simulator.run_steps(5)
    assert len(generators) == 2
    assert [generator.get_state()[2] for generator in generators] == before
