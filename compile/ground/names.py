"""Names for Nengo objects that are the same in every process.

Nengo's own ``str`` falls back to memory addresses for objects without a label; these names do not.
They can be printed anywhere: control characters of labels are escaped.
"""

from collections import Counter
from collections.abc import Mapping
from typing import TypeAlias

import nengo
from nengo.base import NengoObject, ObjView
from nengo.connection import LearningRule
from nengo.ensemble import Neurons

from spikeport.errors import printable

Named: TypeAlias = NengoObject | nengo.Network
"""An ensemble, node, connection or probe, or a network of them."""
End: TypeAlias = NengoObject | Neurons | ObjView | LearningRule
"""An end of a connection, or an object that a probe records from."""


def span(first: str, last: str) -> str:
    """Return the name of what is made of several objects, by the first and the last of them."""
    return first if first == last else f"{first} .. {last}"


class Names:
    """Readable, unique and reproducible names of the objects of a network.

    An ensemble, node or subnetwork is called by its label, or by its kind and position; objects in
    subnetworks are prefixed with the subnetwork's name; a connection is ``pre -> post``. Names that
    occur again get ``#2``, ``#3`` and so on, in the order of definition.

    Parameters
    ----------
    network : nengo.Network
        The network.
    known : mapping of objects to str, optional
        Objects that have a name already, and keep it.
    """

    def __init__(self, network: nengo.Network, known: Mapping[Named, str] | None = None) -> None:
        self._names: dict[Named, str] = dict(known or {})
        self._taken: Counter[str] = Counter(self._names.values())
        self._names.setdefault(network, self._unique(network.label or "network"))
        self._name_objects(network, prefix="")
        for connection in network.all_connections:
            self._name(connection)

    def __getitem__(self, obj: Named | End) -> str:
        """Return the name of an object, of its neurons, of a view, or of a builder's own object."""
        return self._name(base(obj))

    def with_ends(self, obj: Named) -> tuple[str, ...]:
        """Return the name of an object and, if it is a connection, the names of its ends."""
        ends = (obj.pre_obj, obj.post_obj) if isinstance(obj, nengo.Connection) else ()
        return (self[obj], *(self[end] for end in ends if base(end) in self))

    def name_as(self, obj: Named, name: str) -> None:
        """Name an object that a builder made after the object that it stands for."""
        self._names.setdefault(obj, name)

    def known(self, obj: Named) -> str:
        """Return the name that an object has already, or an empty text.

        Indexing would name an object without a name, which changes the numbers in later names.
        """
        return self._names.get(obj, "")

    def __contains__(self, obj: object) -> bool:
        return obj in self._names

    def _name(self, obj: Named) -> str:
        if obj not in self._names:
            self._names[obj] = self._unique(self._describe(obj))
        return self._names[obj]

    def _name_objects(self, network: nengo.Network, prefix: str) -> None:
        for kind in ("ensembles", "nodes", "networks", "probes"):
            for i, obj in enumerate(getattr(network, kind)):
                if obj not in self._names:
                    self._names[obj] = self._unique(prefix + (obj.label or f"{kind}[{i}]"))
        for sub in network.networks:
            self._name_objects(sub, prefix=self._names[sub] + ".")

    def _describe(self, obj: Named) -> str:
        if isinstance(obj, nengo.Connection):
            return self._arrow(obj)
        return getattr(obj, "label", None) or type(obj).__name__

    def _arrow(self, connection: nengo.Connection) -> str:
        return f"{self._end(connection.pre_obj)} -> {self._end(connection.post_obj)}"

    def _end(self, obj: End) -> str:
        obj = base(obj)
        if isinstance(obj, nengo.Connection):
            return self._name(obj)
        # Only ends that the builder adds have no name, and it adds them for read-outs alone.
        return self._names.get(obj, "read-out")

    def _unique(self, name: str) -> str:
        name = printable(name)
        self._taken[name] += 1
        # A label may itself look like a numbered name.
        return name if self._taken[name] == 1 else self._unique(f"{name}#{self._taken[name]}")


def base(obj: Named | End) -> Named:
    """Return the ensemble or node behind a view, its neurons, or a learning rule's connection."""
    if isinstance(obj, ObjView):
        obj = obj.obj
    if isinstance(obj, Neurons):
        return obj.ensemble
    if isinstance(obj, LearningRule):
        return obj.connection
    return obj
