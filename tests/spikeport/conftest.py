"""The command line, in this process and in one of its own, and a network that a user wrote."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from spikeport import cache
from spikeport.cache import Cache
from spikeport.cli import main
from tests.helpers import stages

SCRIPT = Path(sys.executable).with_name("spikeport")

NETWORK = """
from __future__ import annotations

import math
from dataclasses import dataclass

import nengo


@dataclass
class Sizes:
    n_neurons: int


def make(n_neurons: int = 20, tau: float = 0.005, label: str = "neurons") -> nengo.Network:
    sizes = Sizes(n_neurons)
    with nengo.Network(seed=1) as net:
        stimulus = nengo.Node([0.5])
        ensemble = nengo.Ensemble(sizes.n_neurons, 1, label=label)
        nengo.Connection(stimulus, ensemble, synapse=tau)
        nengo.Probe(ensemble, synapse=0.01)
    return net


def does_not_fit():
    with nengo.Network(seed=1) as net:
        nengo.Ensemble(10, 1, neuron_type=nengo.Tanh(), label="wrong neurons")
        a = nengo.Ensemble(10, 1, label="a")
        b = nengo.Ensemble(10, 1, label="b")
        nengo.Connection(a, b, synapse=nengo.Alpha(0.01))
    return net


def too_large():
    with nengo.Network(seed=1) as net:
        nengo.Ensemble(200_000, 1, label="crowd")
    return net


def empty():
    with nengo.Network(seed=1) as net:
        nengo.Node([0.5])
    return net


def needs(size):
    return nengo.Network()


def raises_value_error():
    raise ValueError("the sizes do not match")


def raises_type_error():
    return len(3)


def divides_by_zero():
    return 1 / 0


class Strange(BaseException):
    pass


def raises_no_exception():
    raise Strange("half \\ud83d")


def exits():
    raise SystemExit(0)


def builds_for_ever():
    while True:
        try:
            sum(range(1000))
        except Exception:
            pass


def raises_in_a_node():
    with nengo.Network(seed=1) as net:
        stimulus = nengo.Node(lambda t: 1 / (t < 0.005), size_out=1)
        ensemble = nengo.Ensemble(20, 1)
        nengo.Connection(stimulus, ensemble)
        nengo.Probe(ensemble, synapse=0.01)
    return net


def ends_when_called():
    calls = iter([1.0])  # the first call is Nengo's, which finds the size

    def function(*_):
        return next(calls, None) or exits()

    return function


def exits_in_a_connection():
    with nengo.Network(seed=1) as net:
        a, b = (nengo.Ensemble(20, 1) for _ in "ab")
        nengo.Connection(a, b, function=ends_when_called(), label="c")
    return net


def exits_in_a_node():
    with nengo.Network(seed=1) as net:
        ensemble = nengo.Ensemble(20, 1)
        nengo.Connection(nengo.Node(ends_when_called()), ensemble)
        nengo.Probe(ensemble, synapse=0.01)
    return net


def makes_errors_of_warnings():
    import warnings

    net = make()
    warnings.simplefilter("error")
    return net


def returns_text():
    return "network"
"""


class Done(NamedTuple):
    """The end of a command: its exit code, and its output without lines of progress."""

    code: int
    out: str
    err: str


@pytest.fixture
def without_stages() -> Callable[[str], str]:
    """Take the lines of progress out of an error stream."""
    return lambda err: stages.taken_out(err)


@pytest.fixture
def spikeport(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    without_stages: Callable[[str], str],
) -> Callable[..., Done]:
    """Run a command in this process; an error that is not the user's ends the test."""

    def run(*arguments: object) -> Done:
        monkeypatch.setattr(sys, "argv", ["spikeport", *map(str, arguments)])
        monkeypatch.setenv("COLUMNS", "300")
        capsys.readouterr()
        with pytest.raises(SystemExit) as end:
            main()
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return Done(int(end.value.code or 0), out, without_stages(err))

    return run


@pytest.fixture
def with_kept(monkeypatch: pytest.MonkeyPatch, kept: Cache) -> None:
    """Let commands use the cache that tests share."""
    monkeypatch.setenv(cache.FOLDER, str(kept.folder))


@pytest.fixture
def start() -> Callable[..., subprocess.Popen[str]]:
    """Start a command in a process of its own."""

    def popen(*arguments: object, **options: object) -> subprocess.Popen[str]:
        return subprocess.Popen(  # type: ignore[call-overload,no-any-return]
            [SCRIPT, *map(str, arguments)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            **options,
        )

    return popen


@pytest.fixture
def net_py(tmp_path: Path) -> Path:
    """Return a file with networks."""
    path = tmp_path / "net.py"
    path.write_text(NETWORK, encoding="utf-8")
    return path
