"""The probes of a network by name; if it has none, probes of its outputs."""

import itertools
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import TypeVar

import nengo
from nengo.base import NengoObject, ObjView
from nengo.ensemble import Neurons

from spikeport.compile.ground.names import Names, base
from spikeport.compile.ground.refusal import RefusedError
from spikeport.errors import UsageError, printable

Result = TypeVar("Result")
NUMBER = re.compile(r"#\d+$")
"""The end of a name that several objects have."""
TAU_S = 0.01
"""Synapse of the probes that are added to ensembles: long enough to see values in spikes."""
DECODED, SPIKES = ("decoded_output", "output"), ("output", "spikes")
"""Attributes that a probe's name leaves out, and attributes of neurons that are spikes."""


def probes_by_name(network: nengo.Network) -> dict[str, nengo.Probe]:
    """Return the probes of a network, by their label, or by the object that they record."""
    names, found = Names(network), dict[str, nengo.Probe]()
    wanted = [
        _labelled(probe, names) if probe.label else _described(probe, names)
        for probe in network.all_probes
    ]
    for probe, name in zip(network.all_probes, wanted, strict=True):
        numbered = (f"{name}#{number}" for number in itertools.count(2))
        # A label may itself look like a numbered name, which is then its own probe's.
        free = (one for one in numbered if one not in found and one not in wanted)
        found[name if name not in found else next(free)] = probe
    return found


def _labelled(probe: nengo.Probe, names: Names) -> str:
    """Return a probe's label, with its networks' labels, but without a number that `Names` adds."""
    name = names[probe]
    return name if name.endswith(probe.label) else NUMBER.sub("", name)


def _described(probe: nengo.Probe, names: Names) -> str:
    part = f"[{_slice(probe.target.slice)}]" if isinstance(probe.target, ObjView) else ""
    usual = not isinstance(probe.obj, Neurons) and probe.attr in DECODED
    what = "" if usual else " spikes" if records_spikes(probe) else f" {probe.attr}"
    return names[base(probe.obj)] + part + what


def _slice(part: slice | list[int]) -> str:
    if not isinstance(part, slice):
        return ", ".join(map(str, part))
    ends = ("" if end is None else str(end) for end in (part.start, part.stop))
    return ":".join(ends) + ("" if part.step is None else f":{part.step}")


def records_spikes(probe: nengo.Probe) -> bool:
    """Return whether a probe records spikes as they are, unfiltered."""
    return (
        isinstance(probe.obj, Neurons)
        and probe.obj.ensemble.neuron_type.spiking
        and probe.attr in SPIKES
        and probe.synapse is None
    )


def probe_outputs(network: nengo.Network) -> list[nengo.Probe]:
    """Add a probe to each output of a network: ensembles and nodes that nothing reads.

    If something reads every object, as in a loop with an environment, each ensemble gets a probe.
    Nengo seeds probes last, so that the rest of the network stays as it is.

    Raises
    ------
    UsageError
        If there are neither outputs nor ensembles.
    """
    found = list(outputs(network)) or network.all_ensembles
    if not found:
        raise UsageError("the network has no probe, and neither outputs nor ensembles to probe")
    with network:
        return [
            nengo.Probe(one, synapse=TAU_S if isinstance(one, nengo.Ensemble) else None)
            for one in found
        ]


def probing_outputs(network: nengo.Network, work: Callable[[], Result]) -> Result:
    """Add probes to a network without any, print their names, and return what ``work`` returns.

    If neurons never fire, values cannot be decoded: their spikes are probed instead.

    Raises
    ------
    UsageError
        If there is nothing to probe.
    """
    probe_outputs(network)
    while True:
        names = printable(", ".join(probes_by_name(network)))
        print(f"note: the network has no probe; probed here: {names}", file=sys.stderr)
        try:
            return work()
        except RefusedError as error:
            if not _probe_spikes(network, error):
                raise


def _probe_spikes(network: nengo.Network, error: RefusedError) -> bool:
    """Probe spikes in place of values that are refused; return whether there were any."""
    names = Names(network)
    undecoded = [probe for probe in network.all_probes if names[probe] in error.about]
    with network:
        for probe in undecoded:
            network.probes.remove(probe)
            nengo.Probe(probe.obj.neurons)
    return bool(undecoded)


def outputs(network: nengo.Network) -> Iterator[NengoObject]:
    """Yield the ensembles, and the nodes with an input, that nothing but themselves reads."""
    read, fed = _read_and_fed(network)
    for ensemble in network.all_ensembles:
        if not read[ensemble]:
            yield ensemble
    for node in network.all_nodes:
        if node.size_out and fed[node] and not read[node]:
            yield node


def _read_and_fed(
    network: nengo.Network,
) -> tuple[Mapping[object, int], Mapping[object, int]]:
    """Return the numbers of connections that leave and reach each object, without self-loops."""
    ends = [(base(c.pre_obj), base(c.post_obj)) for c in network.all_connections]
    distinct = [(pre, post) for pre, post in ends if pre is not post]
    return Counter(pre for pre, _ in distinct), Counter(post for _, post in distinct)
