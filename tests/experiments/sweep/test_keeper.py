"""The network that a worker keeps for its next points."""

import threading
from types import SimpleNamespace

import pytest

from spikeport.errors import BackendError
from spikeport.experiments.sweep.keeper import Keeper


class Closed:
    """A network that notes its name as it is closed."""

    def __init__(self, name, closed):
        self._name, self._closed = name, closed

    def close(self):
        self._closed.append(self._name)


def test_another_key_closes_the_kept_object_before_the_next_is_made():
    closed, keeper = [], Keeper()
    first = keeper.get(1, lambda: Closed("first", closed))
    assert keeper.get(1, lambda: pytest.fail("made again")) is first
    assert closed == []
    keeper.get(2, lambda: Closed(f"after {closed}", closed))
    keeper.drop()
    keeper.drop()
    assert closed == ["first", "after ['first']"]


def test_an_object_that_cannot_be_made_leaves_nothing():
    closed, keeper = [], Keeper()
    keeper.get(1, lambda: Closed("first", closed))
    with pytest.raises(ZeroDivisionError):
        keeper.get(2, lambda: 1 / 0)
    assert keeper.kept is None
    assert closed == ["first"]


def test_an_object_that_cannot_be_closed_is_not_kept():
    def fails():
        raise BackendError("gone")

    keeper = Keeper()
    keeper.get(1, lambda: SimpleNamespace(close=fails))
    with pytest.raises(BackendError, match="gone"):
        keeper.get(2, lambda: pytest.fail("made"))
    assert keeper.kept is None


def test_each_thread_keeps_its_own():
    keeper, found = Keeper(), []
    keeper.get(1, lambda: Closed("mine", []))
    thread = threading.Thread(target=lambda: found.append(keeper.kept))
    thread.start()
    thread.join()
    assert found == [None]
