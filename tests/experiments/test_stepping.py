"""A step of a simulator whose network fails."""

import nengo
import numpy as np
import pytest

from spikeport import Simulator
from spikeport.errors import DivergedError
from spikeport.experiments.stepping import advance


def test_a_value_that_is_not_finite_is_a_robot_that_diverged():
    with nengo.Network() as network:
        source = nengo.Node(lambda t: np.nan if t > 0.0015 else 0.0, label="source")
        nengo.Connection(source, nengo.Node(size_in=1))
    with Simulator(network, backend="reference") as sim:
        advance(sim)
        with pytest.raises(DivergedError, match="non-finite"):
            advance(sim)
