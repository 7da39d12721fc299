"""`Tie`: neurons that encode alike share a decoder, where that takes fewer cores."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, NamedTuple, TypeAlias

import numpy as np
from pydantic import Field

from spikeport.compile.ground.names import Names, span
from spikeport.compile.ground.notices import ignored_warnings
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.expected import Rates, expected_activity
from spikeport.compile.image.tables import part
from spikeport.compile.image.usage import core_uses
from spikeport.compile.loihi.build import build
from spikeport.compile.loihi.discretise import discretise
from spikeport.compile.loihi.extract import extract
from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.compile.passes.base import Context, NetworkPass
from spikeport.compile.passes.pipeline import PassRun, Pipeline, observe_nothing
from spikeport.compile.rewriting.slices import whole_targets
from spikeport.compile.rewriting.tying import Shared, pooled, shareable, tied
from spikeport.errors import CompileError
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.energy import energy
from spikeport.hardware_models.limits import usages

Group: TypeAlias = Sequence[Shared]
"""Connections from ensembles that may be fused together, and shared decoders for them."""
Choice: TypeAlias = tuple[int, ...]
"""The numbers of the groups that are tied."""


@dataclass(frozen=True)
class Tie(NetworkPass):
    """Let neurons of an ensemble that encode alike share a decoder, where that saves cores.

    Neurons with equal encoders get one decoder for each connection, by least squares: they can then
    share an input axon and its synapses. Decoded values change; the pass notes their error.

    Ensembles that may be fused are tied together or not at all. First, all groups are tied. If the
    following passes then need fewer cores, groups that save no core get their own decoders back,
    the largest error first. The network is compiled once for each of these choices.

    Attributes
    ----------
    max_error : float
        The largest allowed rise of the relative rms error of a connection's values.
    negligible : float
        If all groups together save cores, a group stays tied without a test if its error rises by
        at most this; 0 to test each group.
    rate_hz : float
        The firing rate of neurons other than relays for estimates of energy, in spikes per second;
        at most a spike a step counts.
    """

    name: ClassVar[str] = "tie"
    precedes: ClassVar[tuple[str, ...]] = ("split_ensembles", "fuse", "decode_path")
    max_error: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.1
    negligible: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.02
    rate_hz: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 100.0

    def apply(self, rewrite: Rewrite, context: Context) -> Rewrite:
        """Choose the ensembles whose neurons share decoders, and connect them anew."""
        solver = ParameterSolver(rewrite, context.dt_s)
        groups = shareable(rewrite, solver)
        close = [self._close(group) for group in groups]
        trials = _Trials(rewrite, solver, context, self.rate_hz, close)
        choice = self._choice(trials)
        if any(close):
            _compare(trials.outcome(()), trials.outcome(choice), context)
        chosen = [close[number] if number in choice else [] for number in range(len(groups))]
        for group, connections in zip(groups, chosen, strict=True):
            label = f"group {_label(group, rewrite.names)}"
            context.note(label, self._note(group, connections))
        if groups:
            context.note("error", _error(groups, chosen))
        return trials.network(choice)

    def _close(self, group: Group) -> Group:
        return [one for one in group if one.error.added <= self.max_error]

    def _choice(self, trials: "_Trials") -> Choice:
        """Return the numbers of the groups to tie."""
        choice = tuple(number for number, group in enumerate(trials.groups) if group)
        if not choice or not trials.saves(choice, than=()):
            return ()
        added = {n: pooled(one.error for one in trials.groups[n]).added for n in choice}
        # Test the largest error first: it is most worth removing.
        for number in sorted(choice, key=lambda n: -added[n]):
            without = tuple(n for n in choice if n != number)
            if added[number] > self.negligible and not trials.saves(choice, than=without):
                choice = without
        return choice

    def _note(self, group: Group, chosen: Group) -> dict[str, object]:
        lost = f"error rises by more than {self.max_error:g}"
        reason = "saves no core" if self._close(group) else lost
        return {
            "chosen": "tied" if chosen else "own decoders",
            "reason": None if chosen else reason,
            "connections": {"tied": len(chosen), "of": len(group)},
            "error": _error([group], [chosen]),
        }


class _Outcome(NamedTuple):
    """The cores of an image, None if it is refused or does not fit, and joules a step.

    The joules are listed by calibration.
    """

    cores: int | None
    energy_j: Mapping[str, float]


class _Trials:
    """Trial compiles of a network, each with another choice of groups to tie."""

    def __init__(
        self,
        rewrite: Rewrite,
        solver: ParameterSolver,
        context: Context,
        rate_hz: float,
        groups: Sequence[Group],
    ) -> None:
        self._rewrite, self._solver = rewrite, solver
        self._context, self._rate_hz = context, rate_hz
        self._outcomes: dict[Choice, _Outcome] = {}
        self.groups = groups

    def network(self, choice: Choice) -> Rewrite:
        """Return the network with some groups tied."""
        chosen = [one for number in choice for one in self.groups[number]]
        return tied(self._rewrite, chosen, self._solver) if chosen else self._rewrite

    def outcome(self, choice: Choice) -> _Outcome:
        """Return the cores and energy that the network takes with some groups tied."""
        if choice not in self._outcomes:
            self._outcomes[choice] = self._compiled(choice)
        return self._outcomes[choice]

    def saves(self, choice: Choice, than: Choice) -> bool:
        """Return whether one choice takes fewer cores than another."""
        one, other = self.outcome(choice).cores, self.outcome(than).cores
        return one is not None and (other is None or one < other)

    def _compiled(self, choice: Choice) -> _Outcome:
        with ignored_warnings():
            try:
                image = _image(self.network(choice), self._context)
            except CompileError:
                return _Outcome(None, {})
        chip = self._context.chip
        if _overfills_a_core(image, chip):
            return _Outcome(None, {})
        return _Outcome(image.n_cores, _energy_j(image, chip, self._rate_hz))


def _image(rewrite: Rewrite, context: Context) -> ChipImage:
    """Compile a network with the passes that follow, for its cores and energy alone.

    The compile that runs this pass has made the checks, and makes the host's part.
    """
    run = PassRun(Pipeline(context.following), context.chip, context.dt_s, observe_nothing)
    written = whole_targets(run.networks(rewrite), context.dt_s)
    floats = run.blocks(build(written, context.dt_s))
    return run.images(extract(discretise(floats), context.chip.name))


def _overfills_a_core(image: ChipImage, chip: ChipModel) -> bool:
    """Return whether a limit other than the number of cores, which tying may mend, is broken."""
    found = usages(core_uses(image, chip), chip)
    return any(usage.exceeded and usage.resource != "cores" for usage in found)


def _energy_j(image: ChipImage, chip: ChipModel, rate_hz: float) -> dict[str, float]:
    """Return the dynamic energy of a step by each calibration that has figures for it."""
    if image.n_cores > chip.n_cores:
        return {}  # too few cores, so the paths of messages are not known
    # A neuron spikes at most once in a step, however long.
    possible_hz = min(rate_hz, 1 / image.manifest.dt_s)
    activity = expected_activity(image, Rates(possible_hz, _relay_rates_hz(image)))
    reports = [energy(activity, chip, calibration) for calibration in chip.calibrations]
    return {one.calibration: one.dynamic.energy_step.value for one in reports if one.dynamic}


def _relay_rates_hz(image: ChipImage) -> dict[str, float]:
    r"""Return the firing rate of decode neurons that relay zero, by connection.

    .. math:: f = \frac{b}{\theta \, \Delta t}

    with bias b and threshold :math:`\theta`: they integrate without leak. In a pair, one neuron
    gets faster as the other gets slower.
    """
    state = image.compartments
    spikes: dict[str, list[float]] = defaultdict(list)
    for number, block in enumerate(image.manifest.blocks):
        if block.kind == "relay":
            mine = part(image.blocks.start, number)
            # A compartment fires once a step at most.
            spikes[block.owner] += (state.bias[mine] / state.vth[mine]).clip(0, 1).tolist()
    return {owner: float(np.mean(each) / image.manifest.dt_s) for owner, each in spikes.items()}


def _compare(before: _Outcome, after: _Outcome, context: Context) -> None:
    context.note_change("cores", before.cores, after.cores)
    for name in dict.fromkeys([*before.energy_j, *after.energy_j]):
        change = (one.energy_j.get(name) for one in (before, after))
        context.note_change(f"energy_step_j ({name})", *change)


def _error(groups: Sequence[Group], chosen: Sequence[Group]) -> dict[str, float]:
    """Return the relative rms error of all connections that could be tied, before and after."""
    changed = {one.connection for group in chosen for one in group}
    errors = [
        one.error if one.connection in changed else one.error._replace(shared=one.error.own)
        for group in groups
        for one in group
    ]
    error = pooled(errors)
    return {"before": error.before, "after": error.after}


def _label(group: Group, names: Names) -> str:
    """Return the name of the ensembles that a group of connections is decoded from."""
    first, last = (names[group[i].connection.pre_obj] for i in (0, -1))
    return span(first, last)
