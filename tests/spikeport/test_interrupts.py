import multiprocessing
import signal

from spikeport.interrupts import uninterruptible


def blocked():
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def tell(pipe):
    pipe.send(blocked())


def test_processes_started_in_the_block_inherit_blocked_sigint():
    ours, theirs = multiprocessing.Pipe()
    process = multiprocessing.get_context("spawn").Process(target=tell, args=(theirs,))
    assert not blocked()
    with uninterruptible():
        process.start()
    assert not blocked()
    assert ours.recv()
    process.join()
