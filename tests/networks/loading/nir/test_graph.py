"""Flat graphs of nodes and edges, and the refusal of other values."""

import numpy as np
import pytest

from spikeport.networks.loading.nir.graph import Node, flattened
from spikeport.reading.hdf5 import read
from spikeport.reading.mismatch import MismatchError
from tests.helpers import nir_graphs


def values(nodes, edges=()):
    return {"node": {"type": "NIRGraph", "nodes": nodes, "edges": list(edges)}}


INPUT = {"type": "Input", "shape": np.array([2])}
LINEAR = {"type": "Linear", "weight": np.eye(2)}


def test_nodes_of_nested_graphs_are_named_by_their_path(tmp_path):
    graph = flattened(read(nir_graphs.written(tmp_path, nir_graphs.nested())))
    assert set(graph.nodes) == {
        *("delay", "gate", "input", "out", "output"),
        *("inner.input", "inner.scale", "inner.weights", "inner.neurons", "inner.output"),
    }
    assert ("input", "inner.input") in graph.edges
    assert ("inner.output", "out") in graph.edges
    assert graph.nodes["inner.input"].kind == "InnerInput"
    assert graph.nodes["input"].kind == "Input"


def wide(n):
    return {f"n{i}": INPUT for i in range(n)}


INNER = {"type": "NIRGraph", "nodes": {"a": INPUT}, "edges": []}
WHOLE = INNER | {"nodes": {"a": INPUT, "b": LINEAR, "c": INPUT | {"type": "Output"}}}
TWICE = "expected one node a.b, found another in a graph within the graph"


@pytest.mark.parametrize(
    ("found", "message"),
    [
        ({}, "expected a NIR graph, found another HDF5 file"),
        ({"node": {"type": "LIF"}}, "expected the graph of type NIRGraph, found LIF"),
        ({"node": {"type": "NIRGraph"}}, "expected nodes in the graph, found none"),
        (values({"a": np.zeros(1)}), "expected a node a, found an array"),
        (values({"a": {"type": "Linear"}}), "expected weight in Linear a, found none"),
        (values({"a": INPUT}, ["a"]), "expected at most 20,000 edges in the graph, each of two"),
        (
            values({"a": INPUT}, ["a", "b"]),
            "expected edges between the nodes a, found an edge of b, which is not a node",
        ),
        (
            values({"a": INPUT, "b": LINEAR}, ["a", "b"] * 2),
            "expected no repeated edges, found the edge from a to b twice",
        ),
        (values({"a": WHOLE, "a.b": LINEAR}), TWICE),
        (values({"a.b": LINEAR, "a": WHOLE}), TWICE),
        (values({"a": INNER}), "expected one Output in the graph a, found 0"),
        (values(wide(10_001)), "expected at most 10,000 nodes, found more"),
    ],
)
def test_a_value_that_is_not_a_graph_is_refused(found, message):
    with pytest.raises(MismatchError) as caught:
        flattened(found)
    assert str(caught.value).startswith(message)


def test_an_unknown_kind_of_node_is_refused_with_the_known_kinds():
    with pytest.raises(MismatchError, match=r"node a of a kind in Input, Output, .*, found Sine"):
        flattened(values({"a": {"type": "Sine"}}))


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (None, "expected numbers for x in node a, found none"),
        ("text", "expected numbers for x in node a, found another value"),
        (np.array([np.nan]), "expected finite numbers for x in node a, found NaN or infinity"),
        (np.array([1.5]), r"expected whole numbers for x in node a, found [1.5]"),
        (np.array([2**21]), "expected x from -1 to 1,048,576 in node a, found [2097152.]"),
    ],
)
def test_a_parameter_other_than_a_whole_number_in_range_is_refused(value, message):
    node = Node("a", "Scale", {} if value is None else {"x": value})
    with pytest.raises(MismatchError) as caught:
        node.whole("x")
    assert str(caught.value) == message
