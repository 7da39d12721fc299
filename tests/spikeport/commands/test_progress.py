"""The progress of long work: a bar on a terminal, a line for each stage elsewhere."""

import io
import re
import sys

import nengo

from spikeport.commands.progress import progress_bar
from spikeport.compile.pipeline import compile_network


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_each_stage_is_a_line_if_the_output_is_not_a_terminal(capsys):
    with progress_bar() as update:
        for what, share in [("walking", None), ("walking", 0.5), ("to\nrest", 0.1)]:
            update(what, share)
    out, err = capsys.readouterr()
    assert out == ""
    assert re.sub(r"[\d.]+", "T", err) == "[   T s] walking\n[   T s] to\\nrest\n"


def test_a_terminal_shows_stage_share_and_time_left(monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setenv("TERM", "xterm")
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with progress_bar() as update:
        update("half [b]of it", 0.5)
    shown = re.sub(r"\x1b\[[\d;?]*[a-zA-Z]", "", terminal.getvalue())
    assert re.search(r"half \[b\]of it .* 50% \d:\d\d:\d\d -?[\d:-]+ left", shown)


def test_a_compile_names_its_stages(capsys):
    with nengo.Network(seed=0) as network:
        nengo.Connection(nengo.Node([1]), nengo.Ensemble(10, 1))
    with progress_bar() as update:
        compile_network(network, pipeline="fuse,scale_rows,pack", progress=update)
    lines = [line.partition("] ")[2] for line in capsys.readouterr().err.splitlines()]
    names = ["checking rules", "fuse", "building blocks", "scale_rows", "rounding", "pack"]
    assert lines == [f"compiling: {name}" for name in [*names, "verifying"]]


def test_without_moves_a_stage_is_a_plain_line_even_on_a_terminal(monkeypatch):
    terminal = Terminal()
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", terminal)
    with progress_bar(moves=False) as update:
        update("simulating", 0.5)
    assert re.fullmatch(r"\[ +[\d.]+ s\] simulating\n", terminal.getvalue())
