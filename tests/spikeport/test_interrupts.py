import multiprocessing
import os
import signal

import pytest

from spikeport.interrupts import interrupts_deferred, uninterruptible


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_after_the_last_step_is_not_lost():
    def run():
        with interrupts_deferred():
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        run()


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
