"""Networks that learn, each simulator with a network of its own."""

import sys
from types import SimpleNamespace

import learning


def test_simulators_share_no_network(monkeypatch):
    built = []

    class Simulator:
        def __init__(self, network, **_options):
            built.append(network)
            self.step = None

        def __enter__(self):
            return self

        def __exit__(self, *_error):
            pass

    monkeypatch.setattr(learning, "spikeport", SimpleNamespace(Simulator=Simulator))
    monkeypatch.setattr(learning, "nengo", SimpleNamespace(Simulator=Simulator))
    monkeypatch.setattr(learning, "LEARNING", {"one": object})
    monkeypatch.setattr(learning, "cpu_us", lambda *_: {"native": 1.0, "float": 2.0})
    monkeypatch.setattr(sys, "argv", ["learning"])
    learning.main()
    assert len(built) == 2
    assert built[0] is not built[1]
