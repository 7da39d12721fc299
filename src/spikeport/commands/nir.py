"""NIR graphs on the command line: time step, input, differences on the chip, and agreement."""

from collections.abc import Collection, Iterator

import nengo

from spikeport.commands.agreement import Agreement, Played, measured, moved, spikes_of
from spikeport.commands.console import Console, ScreenTable
from spikeport.compile.pipeline import Compilation
from spikeport.compile.report.report import Report
from spikeport.constants import DT_S
from spikeport.errors import UsageError, printable
from spikeport.find_network import NIR
from spikeport.networks.loading.nir.differences import differences
from spikeport.networks.loading.nir.network import NirNetwork


def with_dt(network: str, settings: list[str], dt_s: float | None, spikes: str | None) -> list[str]:
    """Return the settings of a network with the time step that a graph needs.

    Raises
    ------
    UsageError
        If a network that is not a graph has a time step or spikes.
    """
    if network.endswith(NIR):
        return settings if dt_s is None else [*settings, f"dt={dt_s!r}"]
    option = "--dt" if dt_s is not None else "--spikes" if spikes is not None else None
    if option is not None:
        raise UsageError(f"{option}: for a NIR graph, a file ending in {NIR}, not for {network}")
    return settings


def check_loss(network: str, loss_s: float | None, spikes: str | None) -> None:
    """Refuse to measure a loss of a graph, which has neither an input of its own nor a probe."""
    if network.endswith(NIR) and loss_s is not None:
        instead = "leave it out: --spikes"
        if spikes is None:
            instead = "for a graph with inputs, give --spikes FILE.npz or --spikes random, which"
        raise UsageError(
            f"--loss: {network} has no probe to measure at; {instead} compares all of its neurons "
            "with NIR's equations"
        )


def read_spikes(network: nengo.Network, spikes: str | None) -> Played | None:
    """Return a user's spikes for the inputs of a graph; None for other networks."""
    return spikes_of(network.folded, spikes) if isinstance(network, NirNetwork) and spikes else None


def play(network: nengo.Network, spikes: str | None) -> str | None:
    """Feed spikes to the inputs of a graph, and return their origin in words."""
    played = read_spikes(network, spikes)
    if not isinstance(network, NirNetwork) or played is None:
        return None
    for name, feed in network.feeds.items():
        feed.play(played.rows[name], DT_S)
    return f"input: {played.origin}"


def show(network: nengo.Network, compilation: Compilation, played: Played | None) -> None:
    """Print a graph's differences on the chip, and its agreement if there are spikes."""
    show_differences(network, compilation.report)
    if isinstance(network, NirNetwork) and played is not None:
        console = Console(highlight=False)
        console.print(_table(list(measured(network, compilation, played))))
        console.print(f"input: {played.origin}", soft_wrap=True)


def show_differences(network: nengo.Network, report: Report) -> None:
    """Print how the chip differs from NIR's equations, if the network is a graph."""
    if isinstance(network, NirNetwork):
        console, on_host = Console(highlight=False), moved(network, report)
        for line in (
            "differences between the chip and NIR's equations:",
            *_lines(network, on_host),
        ):
            console.print(printable(line), soft_wrap=True)


def _lines(network: NirNetwork, on_host: Collection[str]) -> Iterator[str]:
    last = None
    for name, text in differences(network, on_host):
        if name != last:
            yield f"  {name}"
        yield f"    {text}"
        last = name


def _table(found: list[Agreement]) -> ScreenTable:
    table = ScreenTable("population", title="equal neuron-steps, chip and NIR's equations")
    table.add_numbers("silent", "chip", "spikes in NIR", "on the chip")
    for one in found:
        shares = map(_percent, (one.silent, one.equal))
        table.add_row(printable(one.name), *shares, f"{one.wanted:,}", f"{one.spikes:,}")
    return table


def _percent(share: float) -> str:
    # A single neuron-step that differs is not rounded away.
    return f"{100 * share if share == 1 else min(100 * share, 99.99):.2f} %"
