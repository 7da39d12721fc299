"""Networks that fit on the chip, fit in part, or are refused, each for another reason."""

import nengo
import nengo_loihi
import numpy as np


def fits() -> nengo.Network:
    with nengo.Network(seed=1) as network:
        nengo.Connection(nengo.Node([0.5]), nengo.Ensemble(20, 1))
    return network


def with_foreign_neurons() -> nengo.Network:
    with fits() as network:
        nengo.Connection(
            nengo.Ensemble(10, 1, neuron_type=nengo.Izhikevich()), network.ensembles[0]
        )
    return network


def with_a_foreign_filter() -> nengo.Network:
    with fits() as network:
        nengo.Connection(network.ensembles[0], nengo.Ensemble(10, 1), synapse=nengo.Alpha(0.01))
    return network


def with_a_foreign_rule() -> nengo.Network:
    with fits() as network:
        pre, target = nengo.Ensemble(10, 1), nengo.Node(size_in=1)
        learned = nengo.Connection(pre, target, learning_rule_type=nengo.RLS())
        nengo.Connection(target, learned.learning_rule)
    return network


def with_learning_on_the_host() -> nengo.Network:
    with fits() as network:
        nengo_loihi.add_params(network)
        pre, target = nengo.Ensemble(10, 1), nengo.Node(size_in=1)
        network.config[pre].on_chip = False
        learned = nengo.Connection(pre, target, learning_rule_type=nengo.PES())
        nengo.Connection(target, learned.learning_rule)
    return network


def with_a_sparse_transform() -> nengo.Network:
    with fits() as network:
        transform = nengo.Sparse((2, 2), indices=[[0, 0]], init=[1.0])
        nengo.Connection(nengo.Ensemble(10, 2), nengo.Ensemble(12, 2), transform=transform)
    return network


def with_weights_of_another_size() -> nengo.Network:
    with fits() as network:
        huge = {"gain": [1e5, 1, 1, 1], "bias": [0, 1, 1, 1e6]}
        nengo.Connection(nengo.Node(0.5), nengo.Ensemble(4, 1, **huge))
    return network


def with_an_undefined_function() -> nengo.Network:
    with fits() as network:
        nengo.Connection(network.ensembles[0], nengo.Ensemble(5, 1), function=lambda x: np.nan)
    return network


def with_a_foreign_probe() -> nengo.Network:
    with fits() as network:
        nengo.Probe(network.ensembles[0], "scaled_encoders")
    return network


def only_foreign_neurons() -> nengo.Network:
    with nengo.Network(seed=1) as network:
        nengo.Ensemble(10, 1, neuron_type=nengo.RectifiedLinear())
    return network


def only_ends_of_learning() -> nengo.Network:
    with nengo.Network(seed=1) as network:
        learned = nengo.Connection(
            nengo.Node([1.0]), nengo.Ensemble(10, 1), learning_rule_type=nengo.Voja()
        )
        nengo.Connection(nengo.Node(0.0), learned.learning_rule)
    return network


def without_ensembles() -> nengo.Network:
    with nengo.Network(seed=1) as network:
        nengo.Node(0.0)
    return network
