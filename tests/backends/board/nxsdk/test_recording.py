"""Recording boards: their counts of what is written, and the runs they start."""

from spikeport.backends.board.nxsdk.recording import Board, Contact


class Stepping:
    """A run that only knows if it was closed."""

    closed = False

    def close(self) -> None:
        self.closed = True


def test_ids_of_cores_start_at_4_on_each_chip() -> None:
    board = Board(1, 2, [2, 1], [[0, 0], [0]])
    assert [core.ids for core in board.cores] == [(0, 4), (0, 5), (1, 4)]


def test_registers_synapses_and_axons_are_counted() -> None:
    core = Board(1, 1, [1], [[0]]).cores[0]
    before = core.n_registers
    core.cxCfg[0].configure(bias=1)
    core.numUpdates.configure(numUpdates=1)
    core.synapses[0].configure(CIdx=0, Wgt=1, synFmtId=1, LrnEn=0)
    core.createDiscreteAxon(srcCxId=0, dstChipId=0, dstCoreId=4, dstSynMapId=2)
    core.createPop16Axon(popId=0, srcCxId=1, srcRelCxId=3, dstChipId=0, dstCoreId=4, dstSynMapId=2)
    assert before == 0
    assert core.n_registers == 5
    assert core.contacts == [Contact(0, 0, 4, 2, 0), Contact(1, 0, 4, 2, 3)]


def test_a_board_that_only_records_starts_and_stops_without_a_run() -> None:
    board = Board(1, 1, [1], [[0]])
    for _ in range(2):
        board.start()
        board.run(3)
        assert board.executor.hasStarted()
        board.disconnect()
        assert not board.executor.hasStarted()


def test_a_board_starts_and_stops_the_run_that_it_is_given() -> None:
    stepping = Stepping()

    class Alive(Board):
        runs = staticmethod(lambda _board: stepping)

    board = Alive(1, 1, [1], [[0]])
    assert not board.executor.hasStarted()
    board.start()
    assert board.executor.hasStarted()
    board.run(3, aSync=True)
    assert not stepping.closed
    board.disconnect()
    assert stepping.closed
    assert not board.executor.hasStarted()
