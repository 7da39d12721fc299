"""Settings of single objects in ``network.config``: nengo-loihi's, and the decode path.

::

    spikeport.add_params(network)
    network.config[connection].decode_path = "direct"
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import nengo
import nengo_loihi
from nengo.base import NengoObject
from nengo.exceptions import ConfigError
from nengo.params import EnumParam, NumberParam

PATHS = ("auto", "direct", "onoff", "preset10", "host")
OURS = ("decode_path", "target_filter_s")
OPTIONS = {nengo.Ensemble: ("block_shape", "on_chip"), nengo.Connection: ("pop_type", *OURS)}
"""The options of ensembles and connections."""
UNSET = (None, "auto")
"""Values that count as not set."""


def add_params(network: nengo.Network) -> None:
    """Add the options of nengo-loihi, and two for connections, to a network's config.

    ``decode_path`` sets how a decoded connection between ensembles on the chip is wired:
    ``"direct"`` from neuron to neuron, over a relay of ``"onoff"`` or ``"preset10"`` decode
    neurons, over the ``"host"``, or ``"auto"``, as the pass ``decode_path`` chooses. Without that
    pass, which is part of ``compact``, ``"direct"`` and ``"host"`` have no effect.

    ``target_filter_s`` is the time constant, in seconds, of the target's compartments behind a
    relay of ``"onoff"`` or ``"preset10"``; None: as nengo-loihi filters. The pass ``decode_path``
    sets it.

    `NetworkSettings` says in which network's config an option is read; an option that is set
    elsewhere is refused (SP019).
    """
    nengo_loihi.add_params(network)
    connections = network.config[nengo.Connection]
    if "decode_path" not in connections._extra_params:
        param = EnumParam("decode_path", default="auto", values=PATHS)
        connections.set_param("decode_path", param)
        after = NumberParam("target_filter_s", default=None, low=0, optional=True)
        connections.set_param("target_filter_s", after)


def set_defaults() -> None:
    """Change Nengo's defaults to nengo-loihi's: rates, intercepts and voltages that suit the chip.

    Ensembles fire at 100 to 120 Hz at most, with intercepts from -1 to 0.5; all voltages begin at
    zero. The change holds for all networks that this process builds afterwards.
    """
    nengo_loihi.set_defaults()


class Unread(NamedTuple):
    """A setting in a network's config where it is not read, and the network where it would be read.

    It is a setting of an object, or of all ensembles of a network.
    """

    obj: NengoObject | nengo.Network
    name: str
    network: nengo.Network
    read: nengo.Network


class NetworkSettings:
    """The settings of a network's objects.

    nengo-loihi reads ``on_chip`` in the config of the outermost network, and its other options in
    the config of the network that holds the object. Our options are read there first, then in the
    networks around it; "auto" counts as not set.

    Parameters
    ----------
    network : nengo.Network
        The network.
    """

    def __init__(self, network: nengo.Network) -> None:
        self._network = network
        self._networks = (network, *network.all_networks)
        self._around: dict[nengo.Network, nengo.Network] = {}
        self._holder: dict[NengoObject, nengo.Network] = {}
        for net in self._networks:
            self._around |= dict.fromkeys(net.networks, net)
            self._holder |= dict.fromkeys((*net.ensembles, *net.connections), net)

    def get(self, obj: NengoObject, name: str) -> Any:
        """Return the setting of an object, or None where it has none or there is no such option."""
        found = (_setting(net, obj, name) for net in self._read(obj, name))
        return next((value for value in found if value not in UNSET), None)

    def unread(self) -> Iterator[Unread]:
        """Yield the settings that are in configs where nothing reads them.

        A setting that equals the setting that is read is left out: nothing is lost.
        """
        for net in self._networks:
            for obj, name, value in _set_options(net):
                read = list(self._read(obj, name))
                if obj in self._holder and net not in read and value != self.get(obj, name):
                    yield Unread(obj, name, net, read[0])
        for net in self._networks[1:]:
            if _setting(net, nengo.Ensemble, "on_chip") is not None:
                yield Unread(net, "on_chip", net, self._network)

    def _read(self, obj: NengoObject, name: str) -> Iterator[nengo.Network]:
        """Yield the networks in whose configs a setting of an object is read, first to last."""
        holder = self._holder.get(obj, self._network)
        if name == "on_chip":
            yield self._network
            return
        yield holder
        while name in OURS and holder in self._around:
            yield (holder := self._around[holder])

    def copy(
        self, obj: NengoObject, network: nengo.Network, onto: NengoObject | None = None
    ) -> None:
        """Copy the settings of an object into another network, for it or for its replacement."""
        for name in _options(obj):
            if (value := self.get(obj, name)) is not None:
                setattr(network.config[onto or obj], name, value)


def _options(obj: NengoObject) -> list[str]:
    """Return the names of an object's options."""
    return [name for kind, names in OPTIONS.items() if isinstance(obj, kind) for name in names]


def _set_options(network: nengo.Network) -> Iterator[tuple[NengoObject, str, Any]]:
    """Yield the options that are set for single objects in a config, with their values."""
    for obj, own in network.config.params.items():
        if isinstance(obj, NengoObject):
            of_class = own._clsparams
            for name in _options(obj):
                if name in of_class.extra_params and own in of_class.get_param(name):
                    yield obj, name, getattr(own, name)


def _setting(network: nengo.Network, obj: NengoObject | type, name: str) -> Any:
    try:
        return getattr(network.config[obj], name)
    except (ConfigError, AttributeError):
        return None
