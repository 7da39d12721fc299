"""Moves to the host of ensembles that refusals name, until the rest of a network is accepted."""

import contextlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Generic, NamedTuple, TypeVar

import nengo

from spikeport.compile.check.violation import DoesNotFitError, Offloaded, Violation
from spikeport.compile.ground.names import End, Named, Names, base
from spikeport.compile.ground.refusal import RefusedError
from spikeport.compile.ground.scope import Scope
from spikeport.compile.ground.settings import add_params

Result = TypeVar("Result")
OF_THE_CHIP = ("SP2", "SP5")
"""The prefixes of the ids of rules on whole chips and networks, which name no ensemble."""
OF_THE_NETWORK = "SP0"
"""The prefix of the ids of rules that an ensemble breaks by itself, whatever other ensembles do."""
ALSO_ON_THE_HOST = ("SP004", "SP011", "SP013", "SP020")
"""The rules that hold on the host too: on gain and bias, NaN, decoders, and convolutions."""


class Problem(NamedTuple):
    """A refusal: its rule, if any, the object that breaks it, and all objects that it is about."""

    id: str
    rule: str
    object: str
    about: tuple[str, ...]


class Move(NamedTuple):
    """The move of an ensemble to the host, and the problem that it is meant to solve."""

    ensemble: nengo.Ensemble
    problem: Problem


class Offload(Generic[Result]):
    """A search for the ensembles that have to leave the chip, fewest neurons first.

    A move is kept if it solves the problem that it was made for, and undone if not. A problem is
    solved when it is gone, and none of the ensembles that it was about newly breaks its rule. If no
    single move solves a problem, all ensembles that the problem is about are moved.

    Parameters
    ----------
    network : nengo.Network
        The network; its settings are restored at the end.
    attempt : callable
        Compiles the network, or raises `RefusedError`.
    """

    def __init__(self, network: nengo.Network, attempt: Callable[[], Result]) -> None:
        self._network = network
        self._attempt = attempt
        self._names = Names(network)
        self._objects = {self._names[obj]: obj for obj in network.all_objects}
        self.moves: list[Move] = []

    def result(self) -> Result:
        """Move ensembles until the attempt succeeds, and return its result.

        Raises
        ------
        RefusedError
            If no move of an ensemble that the refusal names solves a problem.
        """
        found = self._with([])
        while isinstance(found, RefusedError):
            found = self._improved(found)
        return found

    def offloaded(self, host_spikes: Mapping[nengo.Ensemble, int]) -> tuple[Offloaded, ...]:
        """Return the moved ensembles, with the spikes that each one now sends to the chip."""
        return tuple(
            Offloaded(
                self._names[ensemble],
                ensemble.n_neurons,
                problem.id,
                problem.rule,
                problem.object,
                host_spikes.get(ensemble, 0),
            )
            for ensemble, problem in self.moves
        )

    def _improved(self, error: RefusedError) -> Result | RefusedError:
        """Return the outcome of further moves, or raise the error if no move helps."""
        another: tuple[tuple[Move, ...], RefusedError] | None = None
        for moves in self.possible(error):
            found = self._with([move.ensemble for move in moves])
            if not isinstance(found, RefusedError) or self._solved(moves, error, found):
                self.moves += moves
                return found
            # The same rule may now be broken at another end of the connection that was named.
            if another is None and {move.problem for move in moves}.isdisjoint(problems(found)):
                another = moves, found
        if another is None:
            raise error
        self.moves += another[0]
        return another[1]

    def _solved(self, moves: tuple[Move, ...], error: RefusedError, after: RefusedError) -> bool:
        """Return whether the error after some moves is about other problems than theirs."""
        gone, known = {move.ensemble for move in moves}, problems(error)
        for problem in {move.problem for move in moves}:
            stayed = set(self._ensembles(problem)) - gone
            for left in problems(after):
                # The same rule, newly broken by an ensemble that had broken it: the move has only
                # given the problem another name.
                renamed = left.id == problem.id != "" and left not in known
                if left == problem or (renamed and not stayed.isdisjoint(self._ensembles(left))):
                    return False
        return True

    def possible(self, error: RefusedError) -> list[tuple[Move, ...]]:
        """Return the sets of moves to try, in order.

        First come all moves without an alternative, together; then single moves; then all moves of
        one problem. Each of these is sorted by number of neurons, fewest first.
        """
        scope, refused = Scope(self._network, self._names), _refused_by_host(error)
        moved = {move.ensemble for move in self.moves}
        groups = [
            tuple(
                Move(ensemble, problem)
                for ensemble in self._ensembles(problem)
                if scope.on_chip(ensemble)
                and ensemble not in moved
                and self._names[ensemble] not in refused
            )
            for problem in problems(error)
        ]
        no_choice = {
            group[0].ensemble: group[0]
            for group in groups
            if len(group) == 1 and group[0].problem.id.startswith(OF_THE_NETWORK)
        }
        at_once = tuple(sorted(no_choice.values(), key=lambda move: move.ensemble.n_neurons))
        single = [(move,) for group in groups for move in group]
        several = [group for group in groups if len(group) > 1]
        # Single moves before groups: each ensemble off the chip costs spikes from or to the host.
        others = sorted(single, key=_n_neurons) + sorted(several, key=_n_neurons)
        return [at_once, *others] if at_once else others

    def _ensembles(self, problem: Problem) -> Iterable[nengo.Ensemble]:
        named = (self._objects[name] for name in problem.about if name in self._objects)
        return dict.fromkeys(one for obj in named for one in _ensembles_of(obj))

    def _with(self, more: Sequence[nengo.Ensemble]) -> Result | RefusedError:
        with on_host(self._network, [*(move.ensemble for move in self.moves), *more]):
            try:
                return self._attempt()
            except RefusedError as error:
                return error


def _n_neurons(moves: tuple[Move, ...]) -> int:
    return sum(move.ensemble.n_neurons for move in moves)


def problems(error: RefusedError) -> list[Problem]:
    """Return the problems of an error that a move to the host may solve."""
    if not isinstance(error, DoesNotFitError):
        about = () if error.everywhere else error.about
        return [Problem("", "refusal by nengo-loihi", about[0], about)] if about else []
    return [
        Problem(one.id, one.rule, one.object, _about(one, error))
        for one in error.violations
        if one.id not in ALSO_ON_THE_HOST
    ]


def _about(violation: Violation, error: DoesNotFitError) -> tuple[str, ...]:
    """Return the names of the objects that a violation is about."""
    if violation.id.startswith(OF_THE_CHIP):
        return ()
    return error.owners.get(violation.object, (violation.object,))


def _refused_by_host(error: RefusedError) -> set[str]:
    """Return the names of objects that Nengo would refuse on the host, too."""
    violations = error.violations if isinstance(error, DoesNotFitError) else ()
    return {one.object for one in violations if one.id in ALSO_ON_THE_HOST}


def _ensembles_of(obj: Named | End) -> Iterator[nengo.Ensemble]:
    """Yield an ensemble itself, the ensembles at a connection's ends, or those behind a probe."""
    obj = base(obj)
    if isinstance(obj, nengo.Ensemble):
        yield obj
    elif isinstance(obj, nengo.Connection):
        for end in (obj.pre_obj, obj.post_obj):
            yield from _ensembles_of(end)
    elif isinstance(obj, nengo.Probe):
        yield from _ensembles_of(obj.target)


@contextlib.contextmanager
def on_host(network: nengo.Network, ensembles: Sequence[nengo.Ensemble]) -> Iterator[None]:
    """Keep ensembles on the host for a while, then restore the network's settings."""
    classes = [of for kind, of in network.config.params.items() if isinstance(kind, type)]
    options = [dict(of._extra_params) for of in classes]
    add_params(network)
    # An ensemble without a value of its own follows its class's value, which may change later.
    own = {e: network.config[e].on_chip for e in ensembles if "on_chip" in network.config[e]}
    try:
        for ensemble in ensembles:
            network.config[ensemble].on_chip = False
        yield
    finally:
        for ensemble in ensembles:
            if ensemble in own:
                network.config[ensemble].on_chip = own[ensemble]
            else:
                del network.config[ensemble].on_chip
        # If added options remained, they would change the network's identity, by which compiles
        # are cached.
        for of, before in zip(classes, options, strict=True):
            of._extra_params = before
