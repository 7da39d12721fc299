"""Routes made of axons, several of them for a source that reaches a group several times."""

from spikeport.backends.board.nxsdk.groups import Group, InAxon
from spikeport.backends.board.nxsdk.recording import Board
from spikeport.backends.board.nxsdk.routes import routes_of


def test_a_source_with_two_axons_to_a_group_has_two_routes() -> None:
    board = Board(1, 1, [2], [[0, 0]])
    first, second = board.cores
    for core in board.cores:
        core.cxCfg[0].configure(bias=0)
        core.cxCfg[1].configure(bias=0)
    for source, axon in ((0, 5), (1, 5), (1, 6)):
        first.createDiscreteAxon(source, 0, second.id, axon)
    axons = [InAxon(5, (0, 1, 1), 0), InAxon(6, (0, 1, 1), 0)]
    routed = routes_of(board.cores, [Group(1, 1, 0, axons)], [])
    assert routed.routes.source.tolist() == [0, 0]
    assert routed.routes.group.tolist() == [0, 0]
    assert routed.out_axons.axon.tolist() == [0, 0, -1, 1]
    assert not routed.routes.from_input.any()
