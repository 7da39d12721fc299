import nengo
from nengo.builder import Model

from spikeport.compile.ground.names import Names
from spikeport.compile.ground.rewrite import Piece, Rewrite


def make() -> nengo.Network:
    with nengo.Network(label="net", seed=3) as network:
        nengo.Ensemble(3, 1, label="a")
        nengo.Ensemble(3, 1, label="b")
        nengo.Probe(network.ensembles[0], label="probe")
    return network


def later(*objects: object) -> nengo.Network:
    with nengo.Network(label="later", seed=3) as network:
        for obj in objects:
            nengo.Network.add(obj)
    return network


def test_seeds_are_those_that_nengo_draws_for_a_simulation() -> None:
    network = make()
    seeds = Rewrite(network, Names(network)).all_seeds()
    model = Model()
    model.build(network)
    for obj in (network, *network.ensembles, *network.probes):
        assert seeds[obj] == model.seeds[obj]


def test_a_network_without_a_seed_counts_as_seeded_with_0() -> None:
    network = make()
    network.seed = None
    rewrite = Rewrite(network, Names(network))
    zero = make()
    zero.seed = 0
    expected = Rewrite(zero, Names(zero)).all_seeds()
    assert rewrite.all_seeds()[network] == 0
    assert rewrite.all_seeds()[network.ensembles[0]] == expected[zero.ensembles[0]]


def test_a_seed_that_a_rewrite_sets_is_kept() -> None:
    network = make()
    a, b = network.ensembles
    rewrite = Rewrite(network, Names(network), seeds={a: 42})
    assert rewrite.all_seeds()[a] == 42
    assert rewrite.all_seeds()[b] != 42


def test_stand_ins_of_stand_ins_stand_in_for_the_users_probes() -> None:
    network = make()
    (users,) = network.probes
    with nengo.Network() as other:
        a = nengo.Ensemble(3, 1)
        second, third = nengo.Probe(a), nengo.Probe(a)
    first = Rewrite(network, Names(network)).then(other, {}, stand_ins={users: second})
    assert first.stand_ins == {users: second}
    assert first.then(other, {}, stand_ins={second: third}).stand_ins == {users: third}
    assert first.then(other, {}).stand_ins == {users: second}


def test_objects_keep_their_names_and_stand_ins_take_the_names_of_probes() -> None:
    network = make()
    a, b = network.ensembles
    (users,) = network.probes
    with (other := later(b)):
        stand_in = nengo.Probe(b, label="anything")
        nengo.Ensemble(3, 1, label="b")
    names = Rewrite(network, Names(network)).then(other, {}, stand_ins={users: stand_in}).names
    assert names[other] == "net"
    assert names[b] == "b"
    assert names[stand_in] == "probe"
    assert names[other.ensembles[1]] == "b#2"
    assert a not in names


def test_built_objects_accumulate_over_rewrites_and_seeds_do_not() -> None:
    network = make()
    a, b = network.ensembles
    first = Rewrite(network, Names(network)).then(later(b), {b: 1}, built={a: "gains"})
    second = first.then(later(), {}, built={b: "more"})
    assert (first.built, second.built) == ({a: "gains"}, {a: "gains", b: "more"})
    assert (first.seeds, second.seeds) == ({b: 1}, {})


def test_pieces_are_kept_while_their_ensembles_are_in_the_network() -> None:
    network = make()
    a, b = network.ensembles
    pieces = {a: Piece("large", 0, 2), b: Piece("large", 1, 2)}
    first = Rewrite(network, Names(network)).then(later(a, b), {}, pieces=pieces)
    assert first.pieces == pieces
    assert first.then(later(a), {}).pieces == {a: Piece("large", 0, 2)}
    cut_again = {a: Piece("a", 0, 3)}
    assert first.then(later(a), {}, pieces=cut_again).pieces == cut_again


def test_pieces_and_members_of_fused_ensembles_are_named_as_the_users_ensembles() -> None:
    network = make()
    a, b = network.ensembles
    first = Rewrite(network, Names(network)).then(
        later(a, b), {}, pieces={a: Piece("cut", 0, 2)}, members={b: ("one", "other")}
    )
    assert first.unfused(["a", "b"]) == ("cut", "one", "other")
    assert [first.users_names(one) for one in (a, b)] == [("cut",), ("one", "other")]
    assert first.then(later(a), {}).members == {"b": ("one", "other")}
