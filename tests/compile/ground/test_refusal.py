import nengo
import numpy as np
import pytest
from nengo.exceptions import BuildError, ValidationError

from spikeport.compile.check.violation import DoesNotFitError
from spikeport.compile.ground.refusal import InvalidError, RefusedError
from spikeport.compile.pipeline import compile_network
from spikeport.errors import CompileError


def test_every_refusal_is_also_an_error_of_nengo() -> None:
    for kind in (RefusedError, InvalidError, DoesNotFitError):
        assert issubclass(kind, CompileError)
        assert issubclass(kind, BuildError)
    assert issubclass(InvalidError, ValidationError)


def test_an_invalid_parameter_raises_nengos_validation_error() -> None:
    with nengo.Network(seed=1) as network:
        points = nengo.dists.Samples(np.zeros((3, 1)))
        nengo.Ensemble(5, 1, label="a", eval_points=points, n_eval_points=7)
    with pytest.raises(ValidationError) as raised:
        compile_network(network)
    error = raised.value
    assert type(error) is InvalidError
    assert error.attr == error.__cause__.attr == "samples"
    assert error.obj is error.__cause__.obj
    assert str(error) == (
        "a: Nengo refuses it: Samples.samples: Wrong number of samples requested; got 7, should be "
        "3; cure: change this object"
    )


def test_no_host_helps_a_sparse_transform_of_decoded_values() -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(10, 2), nengo.Ensemble(10, 2)
        nengo.Connection(a, b, transform=nengo.Sparse((2, 2), indices=[[0, 1]]))
    with pytest.raises(RefusedError, match="nengo-loihi refuses it") as raised:
        compile_network(network)
    assert "on_chip" not in str(raised.value)  # Nengo would refuse it on the host
    compile_network(network, pipeline="compact")


def test_a_refusal_caused_by_removing_a_passthrough_node_is_not_everywhere() -> None:
    with nengo.Network(seed=1) as network:
        a, node = nengo.Ensemble(10, 1), nengo.Node(size_in=2)
        nengo.Connection(a[[0, 0]], node, function=lambda x: x)
        nengo.Connection(node, nengo.Ensemble(10, 2))
    with pytest.raises(InvalidError, match="nengo-loihi refuses it") as raised:
        compile_network(network)
    assert not raised.value.everywhere
