import nengo
import numpy as np

from spikeport.compile.ground.names import Names, base


def test_a_labelled_object_is_called_by_its_label() -> None:
    with nengo.Network() as network:
        ensemble = nengo.Ensemble(2, 1, label="arm")
        node = nengo.Node(0.0, label="goal")
        probe = nengo.Probe(ensemble, label="angle")
    names = Names(network)
    assert [names[obj] for obj in (ensemble, node, probe)] == ["arm", "goal", "angle"]


def test_an_unlabelled_object_is_called_by_kind_and_position() -> None:
    with nengo.Network() as network:
        nengo.Ensemble(2, 1, label="first")
        ensemble = nengo.Ensemble(2, 1)
        node = nengo.Node(0.0)
        probe = nengo.Probe(ensemble)
        sub = nengo.Network()
    names = Names(network)
    assert [names[obj] for obj in (network, ensemble, node, probe, sub)] == [
        "network",
        "ensembles[1]",
        "nodes[0]",
        "probes[0]",
        "networks[0]",
    ]


def test_names_that_occur_again_are_numbered_in_order() -> None:
    with nengo.Network() as network:
        ensembles = [nengo.Ensemble(2, 1, label="a") for _ in range(3)]
        connections = [nengo.Connection(ensembles[0], ensembles[1]) for _ in range(2)]
    names = Names(network)
    assert [names[obj] for obj in ensembles] == ["a", "a#2", "a#3"]
    assert [names[obj] for obj in connections] == ["a -> a#2", "a -> a#2#2"]


def test_a_label_that_looks_numbered_does_not_give_two_objects_one_name() -> None:
    with nengo.Network(label="a") as network:
        ensembles = [nengo.Ensemble(2, 1, label=label) for label in ("a", "a#2", "a", "a#3")]
    names = Names(network)
    assert len({names[obj] for obj in [network, *ensembles]}) == 5


def test_objects_of_a_subnetwork_are_prefixed_with_its_name() -> None:
    with nengo.Network() as network, nengo.Network(label="outer"):
        with nengo.Network():
            deep = nengo.Ensemble(2, 1, label="deep")
        array = nengo.networks.EnsembleArray(2, 2, label="array")
    names = Names(network)
    assert names[deep] == "outer.networks[0].deep"
    assert names[array.input] == "outer.array.input"


def test_a_connection_is_an_arrow_between_its_ends() -> None:
    with nengo.Network() as network:
        a = nengo.Ensemble(2, 2, label="a")
        b = nengo.Node(size_in=1, label="b")
        sliced = nengo.Connection(a[0], b)
        neurons = nengo.Connection(a.neurons[:1], b)
    names = Names(network)
    assert (names[sliced], names[neurons]) == ("a -> b", "a -> b#2")


def test_an_error_connection_points_at_the_connection_that_learns() -> None:
    with nengo.Network() as network:
        error = nengo.Node(0.0, label="error")
        with nengo.Network(label="sub"):
            a = nengo.Ensemble(2, 1, label="a")
            b = nengo.Node(size_in=1, label="b")
            learned = nengo.Connection(a, b, learning_rule_type=nengo.PES())
        teaching = nengo.Connection(error, learned.learning_rule)
    names = Names(network)
    assert names[teaching] == "error -> sub.a -> sub.b"


def test_a_view_and_the_neurons_are_called_like_the_ensemble() -> None:
    with nengo.Network() as network:
        a = nengo.Ensemble(4, 2, label="a")
    names = Names(network)
    assert [names[obj] for obj in (a, a[0], a.neurons, a.neurons[1:])] == ["a"] * 4


def test_base_of_a_learning_rule_is_its_connection() -> None:
    with nengo.Network():
        a = nengo.Ensemble(2, 1)
        learned = nengo.Connection(a, nengo.Node(size_in=1), learning_rule_type=nengo.PES())
    assert base(learned.learning_rule) is learned


def test_objects_that_the_builder_adds_are_called_read_out_or_by_their_kind() -> None:
    with nengo.Network() as network:
        a = nengo.Ensemble(2, 1, label="a")
        probe = nengo.Probe(a, add_to_container=False)
        connection = nengo.Connection(a, probe, add_to_container=False)
    names = Names(network)
    assert (names[connection], names[probe]) == ("a -> read-out", "Probe")


def test_no_name_holds_a_memory_address() -> None:
    with nengo.Network() as network:
        nengo.networks.Product(3, 2)
        a = nengo.Ensemble(2, 1)
        nengo.Connection(a, a)
        nengo.Probe(a)
    names = Names(network)
    objects = [
        *network.all_objects,
        nengo.Ensemble(2, 1, add_to_container=False),
        nengo.Node(0.0, add_to_container=False),
    ]
    assert not [names[obj] for obj in objects if " at 0x" in names[obj]]
    assert len({names[obj] for obj in objects}) == len(objects)


def test_characters_of_a_label_that_cannot_be_printed_are_escaped() -> None:
    with nengo.Network() as network:
        bell = nengo.Ensemble(2, 1, label="a\x07b\r\x1b[31m")
        lone = nengo.Ensemble(2, 1, label="half \ud83d")
        plain = nengo.Ensemble(2, 1, label="Größe 10 µm")
        connection = nengo.Connection(bell, lone)
    names = Names(network)
    assert names[bell] == r"a\x07b\r\x1b[31m"
    assert names[lone] == r"half \ud83d"
    assert names[plain] == "Größe 10 µm"
    assert names[connection] == r"a\x07b\r\x1b[31m -> half \ud83d"


def test_with_ends_returns_a_connections_name_and_the_names_of_its_ends() -> None:
    with nengo.Network() as network:
        a, b = nengo.Ensemble(3, 1, label="a"), nengo.Ensemble(3, 1, label="b")
        learned = nengo.Connection(a.neurons, b[0:1], transform=np.ones((1, 3)))
        foreign = nengo.Connection(a, nengo.Node(size_in=1, add_to_container=False))
    names = Names(network)
    assert names.with_ends(learned) == ("a -> b", "a", "b")
    assert names.with_ends(foreign) == ("a -> read-out", "a")
    assert names.with_ends(a) == ("a",)


def test_known_gives_no_new_name_to_an_unnamed_object() -> None:
    with nengo.Network() as network:
        a = nengo.Ensemble(3, 1, label="a")
        other = nengo.Ensemble(3, 1, label="a", add_to_container=False)
    names = Names(network)
    assert (names.known(a), names.known(other)) == ("a", "")
    assert other not in names
