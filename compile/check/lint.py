"""Rules that a network must keep before nengo-loihi builds it; all breaches are found at once.

nengo-loihi finds some breaches one at a time, some as an assertion without text, and lets others
pass in silence (it builds a subclass of LIF as plain LIF). The rules were found by reading
nengo-loihi 1.1.0's builder, and the tests of this module confirm them. ``rules.toml`` has the text
and reason of each rule, SP0xx.
"""

from collections import Counter
from collections.abc import Callable, Hashable, Iterator

import nengo
import numpy as np
from nengo.connection import LearningRule
from nengo.dists import Distribution
from nengo.ensemble import Neurons
from nengo.params import iter_params
from nengo_loihi.dvs import DVSFileChipProcess
from nengo_loihi.inputs import ChipProcess

from spikeport.compile.check import rules
from spikeport.compile.check.loops import components
from spikeport.compile.check.violation import Violation
from spikeport.compile.ground.filters import delay_s
from spikeport.compile.ground.names import End, base
from spikeport.compile.ground.scope import (
    CONVOLUTIONS,
    MATRICES,
    Scope,
    full_weights,
    in_full,
    is_link,
    is_passthrough,
    is_plain,
    probeable,
    source_rows,
)
from spikeport.compile.ground.settings import NetworkSettings
from spikeport.neurons import OWN_TYPES

ARRAYS = ("gain", "bias", "encoders", "max_rates", "intercepts", "eval_points", "function")
"""Parameters of ensembles and connections that can be arrays, besides transforms."""


def lint(scope: Scope, rewritten: bool = True) -> list[Violation]:
    """Return every breach of every rule, in the order of `RULES`.

    Before a network is rewritten, only the rules that no pass over it can mend are checked.
    """
    rules_ = [rule for rule in RULES if rewritten or rule not in MENDED]
    return [violation for rule in rules_ for violation in rule(scope)]


def some_ensemble(scope: Scope) -> Iterator[Violation]:
    """Refuse a network without an ensemble on the chip."""
    if not scope.ensembles:
        yield rules.get("SP001").broken(scope.names[scope.network], _kept_off(scope))


def _kept_off(scope: Scope) -> str:
    """Say how many ensembles there are, and why none of them is on the chip."""
    reasons = Counter(scope.off_chip(e) for e in dict.fromkeys(scope.network.all_ensembles))
    if not reasons:
        return "0"
    return f"0 of {reasons.total()}: " + ", ".join(f"{n} {why}" for why, n in reasons.items())


def neuron_type(scope: Scope) -> Iterator[Violation]:
    """Refuse neurons other than LIF and integrate-and-fire; subclasses of these are refused too."""
    for ensemble in scope.ensembles:
        kind = ensemble.neuron_type
        if not is_plain(kind) and type(kind) not in OWN_TYPES:
            yield rules.get("SP002").broken(scope.names[ensemble], type(kind).__name__)


def ensemble_noise(scope: Scope) -> Iterator[Violation]:
    """Refuse ``Ensemble.noise``, which nengo-loihi does not map."""
    for ensemble in scope.ensembles:
        if ensemble.noise is not None:
            yield rules.get("SP003").broken(scope.names[ensemble], type(ensemble.noise).__name__)


def gain_and_bias(scope: Scope) -> Iterator[Violation]:
    """Refuse a gain without a bias, and a bias without a gain."""
    for ensemble in scope.ensembles:
        if (ensemble.gain is None) != (ensemble.bias is None):
            stated = "bias" if ensemble.gain is None else "gain"
            yield rules.get("SP004").broken(scope.names[ensemble], f"{stated} only")


def synapse(scope: Scope) -> Iterator[Violation]:
    """Refuse filters other than the chip's own, a first-order low-pass."""
    for connection in scope.network.all_connections:
        # The host filters its values before it sends them as spikes, with any filter.
        filtered_on_chip = scope.on_chip(connection.post_obj) and (
            scope.on_chip(connection.pre_obj) or isinstance(connection.pre_obj, Neurons)
        )
        kind = type(connection.synapse)
        if filtered_on_chip and kind not in (nengo.Lowpass, type(None)):
            late_s = delay_s(connection.synapse) or 0.0
            rule, tau_s = rules.get("SP005"), f"{late_s:g}" if late_s > 0 else "tau"
            broken = rule.broken(scope.names[connection], kind.__name__, tau_s=tau_s)
            by_host = is_link(connection, scope)
            yield broken.or_else(rule.in_case["decoded"]) if by_host else broken


def post_slice(scope: Scope) -> Iterator[Violation]:
    """Refuse convolutions into a part of an ensemble on the chip: their weights would be unshared.

    Any other transform is extended to the whole ensemble: see `spikeport.compile.rewriting.slices`.
    """
    for connection in scope.network.all_connections:
        matrix = isinstance(connection.transform, MATRICES)
        if scope.reaches_part(connection) and not matrix and not in_full(connection):
            part = f"{connection.size_out} of {connection.post_obj.size_in} neurons"
            yield rules.get("SP006").broken(scope.names[connection], part)


def convolved_twice(scope: Scope) -> Iterator[Violation]:
    """Refuse convolutions that read a neuron on the chip twice: nengo-loihi keeps one position."""
    for connection in scope.network.all_connections:
        if scope.repeats_spikes(connection) and not isinstance(connection.transform, MATRICES):
            rows = source_rows(connection)
            read = f"{len(rows)} of {len(np.unique(rows))} neurons"
            yield rules.get("SP014").broken(scope.names[connection], read)


def convolved_values(scope: Scope) -> Iterator[Violation]:
    """Refuse convolutions of decoded values, on the chip and on the host, as Nengo does."""
    for connection in scope.network.all_connections:
        pre = connection.pre_obj
        decoded = isinstance(pre, nengo.Ensemble) and not isinstance(pre.neuron_type, nengo.Direct)
        if decoded and isinstance(connection.transform, CONVOLUTIONS):
            kind = f"{type(connection.transform).__name__} of decoded values"
            yield rules.get("SP020").broken(scope.names[connection], kind)


def learning_rule(scope: Scope) -> Iterator[Violation]:
    """Refuse learning rules other than a single PES on connections from an ensemble on the chip.

    nengo-loihi accepts no list or dict of rules, even if all of them are PES.
    """
    for connection in scope.network.all_connections:
        rule = connection.learning_rule_type
        if rule is None or not scope.on_chip(connection.pre_obj):
            continue
        if type(rule) is not nengo.PES:
            kinds = rule.values() if isinstance(rule, dict) else rule
            several = isinstance(rule, list | dict)
            inside = " of " + ", ".join(type(one).__name__ for one in kinds) if several else ""
            used = type(rule).__name__ + inside
            yield rules.get("SP007").broken(scope.names[connection], used)


def learned_neurons(scope: Scope) -> Iterator[Violation]:
    """Refuse PES from an ensemble on the chip to neurons.

    Nengo multiplies the errors by the neurons' encoders, which nengo-loihi leaves out.
    """
    for connection in scope.network.all_connections:
        to_neurons = isinstance(connection.post_obj, Neurons)
        learns = isinstance(connection.learning_rule_type, nengo.PES)
        if learns and to_neurons and scope.on_chip(connection.pre_obj):
            yield rules.get("SP016").broken(scope.names[connection], "neurons")


def weights_to_host(scope: Scope) -> Iterator[Violation]:
    """Refuse full weights from an ensemble on the chip to one on the host."""
    for connection in scope.network.all_connections:
        pre, post = connection.pre_obj, connection.post_obj
        to_host = isinstance(post, nengo.Ensemble) and not scope.on_chip(post)
        if to_host and full_weights(connection) and scope.on_chip(pre):
            yield rules.get("SP018").broken(scope.names[connection], "full weights")


def chip_process(scope: Scope) -> Iterator[Violation]:
    """Refuse nodes that would run on the board, except event files.

    Connections from event files to the host are refused as well.
    """
    for node in scope.network.all_nodes:
        if isinstance(node.output, ChipProcess) and type(node.output) is not DVSFileChipProcess:
            yield rules.get("SP009").broken(scope.names[node], type(node.output).__name__)
    for connection in scope.network.all_connections:
        from_chip = isinstance(connection.pre_obj, nengo.Node) and scope.on_chip(connection.pre_obj)
        if from_chip and not scope.on_chip(connection.post_obj):
            yield rules.get("SP009").broken(scope.names[connection], "to the host")


def probe(scope: Scope) -> Iterator[Violation]:
    """Refuse probes of values that the chip does not record."""
    for recorded in scope.network.all_probes:
        obj = base(recorded.obj)  # the connection, if a learning rule is probed
        if not scope.on_chip(obj.pre_obj if isinstance(obj, nengo.Connection) else obj):
            continue
        allowed = probeable(recorded.obj)
        if recorded.attr in allowed:
            continue
        used = f"{recorded.attr} of {scope.names[obj]}"
        limit, instead, kept = " or ".join(allowed), "one of these", "it"
        if isinstance(obj, nengo.Connection):
            limit, instead = "no attribute of a connection", "an end of the connection"
            kept = scope.names[base(obj.pre_obj)]
        elif not allowed:
            limit, instead = "no attribute of a node on the chip", "what the node feeds"
        yield rules.get("SP010").broken(
            scope.names[recorded], used, limit, instead=instead, kept=kept
        )


def finite(scope: Scope) -> Iterator[Violation]:
    """Refuse arrays of ensembles and connections that are not finite."""
    network = scope.network
    for obj in [*network.all_ensembles, *network.all_connections]:
        odd = [name for name, array in _arrays(obj) if not np.isfinite(array).all()]
        if odd:
            yield rules.get("SP011").broken(scope.names[obj], f"NaN or infinity in {odd[0]}")


def users_decoders(scope: Scope) -> Iterator[Violation]:
    """Refuse decoders of another shape than (neurons, values of the function)."""
    for connection in scope.network.all_connections:
        decoders, pre = getattr(connection.solver, "values", None), connection.pre_obj
        limit = (pre.n_neurons, connection.size_mid) if isinstance(pre, nengo.Ensemble) else None
        if decoders is not None and limit not in (None, decoders.shape):
            name = scope.names[connection]
            yield rules.get("SP013").broken(name, str(decoders.shape), str(limit))


def host_neurons(scope: Scope) -> Iterator[Violation]:
    """Refuse neurons on the host that reach the chip, but do not spike or have negative spikes."""
    for connection in scope.from_host_neurons():
        kind = connection.pre_obj.ensemble.neuron_type
        if not kind.spiking or kind.negative:
            how = "with negative spikes" if kind.spiking else "which does not spike"
            used = f"{type(kind).__name__}, {how}"
            yield rules.get("SP015").broken(scope.names[connection], used)


def host_cycles(scope: Scope) -> Iterator[Violation]:
    """Refuse loops on the host without a synapse, as Nengo does."""
    direct = [
        c
        for c in scope.network.all_connections
        if c.synapse is None
        and not isinstance(c.post_obj, LearningRule)
        and not any(scope.on_chip(base(end)) for end in (c.pre_obj, c.post_obj))
    ]
    edges = [pair for c in direct for pair in _edges_through(c)]
    loop = components(edges)
    size = Counter(loop.values())
    last = {loop[c]: c for c in direct if size[loop[c]] > 1}
    for connection in last.values():
        yield rules.get("SP017").broken(scope.names[connection], "none")


def _edges_through(connection: nengo.Connection) -> Iterator[tuple[Hashable, Hashable]]:
    """Yield pairs (entry that is read, connection) and (connection, entry that is reached)."""
    read = _entries(connection.pre_obj, connection.pre_slice)
    reached = _entries(connection.post_obj, connection.post_slice)
    yield from ((one, connection) for one in read)
    yield from ((connection, one) for one in reached)


def _entries(end: End, part: slice | list[int]) -> list[tuple[object, int]]:
    """Return the entries of a passthrough node that a slice covers in Nengo's search for cycles.

    Any other object is a single entry, since each of its values may depend on all inputs. Nengo
    takes a list to cover all entries, and a slice with a step all entries between its ends.
    """
    if not is_passthrough(end):
        return [(base(end), 0)]
    rows = np.arange(end.size_in)[part if isinstance(part, slice) else slice(None)]
    return [(end, row) for row in range(rows.min(initial=end.size_in), rows.max(initial=-1) + 1)]


def unread_settings(scope: Scope) -> Iterator[Violation]:
    """Refuse settings in a network's config where nothing reads them: they have no effect."""
    for one in NetworkSettings(scope.network).unread():
        where, read = (_config_of(scope, network) for network in (one.network, one.read))
        used, limit = f"{one.name} in {where}", f"in {read}"
        yield rules.get("SP019").broken(scope.names[one.obj], used, limit)


def _config_of(scope: Scope, network: nengo.Network) -> str:
    outermost = network is scope.network
    return f"the config of {'the outermost network' if outermost else scope.names[network]}"


def _arrays(obj: nengo.Ensemble | nengo.Connection) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the arrays of an ensemble or connection, by name."""
    if isinstance(obj, nengo.Connection):
        yield from _numbers("transform", getattr(obj.transform, "init", None))
    for name in ARRAYS:
        yield from _numbers(name, getattr(obj, name, None))


def _numbers(name: str, value: object) -> Iterator[tuple[str, np.ndarray]]:
    if isinstance(value, Distribution):
        for param in iter_params(value):
            yield from _numbers(name, getattr(value, param))
    elif isinstance(value, np.ndarray | float | int) and np.asarray(value).dtype.kind in "fiu":
        yield name, np.asarray(value)


RULES: tuple[Callable[[Scope], Iterator[Violation]], ...] = (
    some_ensemble,
    neuron_type,
    ensemble_noise,
    gain_and_bias,
    synapse,
    post_slice,
    convolved_twice,
    convolved_values,
    learning_rule,
    learned_neurons,
    weights_to_host,
    chip_process,
    probe,
    finite,
    users_decoders,
    host_neurons,
    host_cycles,
    unread_settings,
)
MENDED = (synapse,)
"""Rules that a pass over a network can mend."""
