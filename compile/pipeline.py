"""`compile_network`: from a network to its chip image, and the report on it.

    network --passes--> network --build--> float blocks --passes--> float blocks
        --round--> integer blocks --extract--> image --passes--> image --verify--> report

`_compiled` goes through this chain once. A refused network goes through it again: with other passes
for a line of advice, or, if the caller asks to offload, with some ensembles on the host.
"""

import contextlib
import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import nengo
from nengo.base import NengoObject

from spikeport import freed_memory
from spikeport.compile.check.advice import AS_WRITTEN, COMPACT, advice
from spikeport.compile.check.cut_off import cut_off_hints
from spikeport.compile.check.hints import (
    filter_hints,
    image_hints,
    network_hints,
    path_hints,
    relay_hints,
)
from spikeport.compile.check.host_loops import host_loop_hints
from spikeport.compile.check.host_neurons import host_neuron_hints
from spikeport.compile.check.learning_rates import learning_rate_hints, unlearnt_hints
from spikeport.compile.check.lint import lint
from spikeport.compile.check.loops import loop_hints
from spikeport.compile.check.memory import over_memory
from spikeport.compile.check.offload import Offload
from spikeport.compile.check.overflow import overflow_hints
from spikeport.compile.check.read_outs import single_spike_hints
from spikeport.compile.check.saturation import saturation_hints
from spikeport.compile.check.verify import (
    verify,
    verify_learning,
    verify_refractory,
    verify_settings,
    verify_size,
)
from spikeport.compile.check.violation import (
    DoesNotFitError,
    NothingOnChipError,
    OnHost,
    Violation,
)
from spikeport.compile.ground.names import Names
from spikeport.compile.ground.notices import collected_warnings, ignored_warnings
from spikeport.compile.ground.refusal import ArgumentError, RefusedError
from spikeport.compile.ground.rewrite import Built, Rewrite
from spikeport.compile.ground.scope import Scope
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.host_traffic import host_traffic
from spikeport.compile.image.usage import core_uses
from spikeport.compile.loihi.blocks import FloatBlocks, IntegerBlocks
from spikeport.compile.loihi.build import build
from spikeport.compile.loihi.build_settings import AS_USUAL, BuildSettings
from spikeport.compile.loihi.discretise import discretise
from spikeport.compile.loihi.extract import extract
from spikeport.compile.loihi.host_spikes import host_spikes
from spikeport.compile.loihi.split_learning import split_learning
from spikeport.compile.passes.parse import parse, targeted
from spikeport.compile.passes.pipeline import Observer, PassRun, Pipeline, observe_nothing
from spikeport.compile.placing.load import block_loads, capacity
from spikeport.compile.placing.lower_bound import lower_bound
from spikeport.compile.report.neurobench import neurobench
from spikeport.compile.report.report import Report
from spikeport.compile.report.summary import verdict
from spikeport.compile.rewriting.called_once import called_once
from spikeport.compile.rewriting.once import each_once
from spikeport.compile.rewriting.relays import compartments_at_least
from spikeport.compile.rewriting.slices import whole_targets
from spikeport.constants import DT_S
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.limits import CoreUse
from spikeport.progress import Progress, Stages, silent

if TYPE_CHECKING:
    from nengo_loihi.builder import Model


RULES, BUILD, ROUND, VERIFY = "checking rules", "building blocks", "rounding", "verifying"
"""The stages of a compile, besides its passes."""


@dataclass(frozen=True)
class Compilation:
    """A compiled network: the image, the report on it, and the blocks of the image.

    ``make_blocks`` returns the blocks. `spikeport.compile.ground.rewrite.Rewrite` describes
    ``stand_ins`` and ``built``.
    """

    image: ChipImage
    report: Report
    make_blocks: Callable[[], IntegerBlocks]
    stand_ins: Mapping[nengo.Probe, nengo.Probe] = field(default_factory=dict)
    built: Mapping[NengoObject, Built] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return the verdict, on one line."""
        return f"<Compilation: {verdict(self.report)}>"

    def __str__(self) -> str:
        """Return the report, on one screen."""
        return str(self.report)

    def _repr_html_(self) -> str:
        """Return the report as a notebook shows it."""
        return self.report._repr_html_()

    @functools.cached_property
    def blocks(self) -> IntegerBlocks:
        """The blocks that the image was made of; a compile from the cache makes them again."""
        return self.make_blocks()

    @property
    def model(self) -> "Model":
        """nengo-loihi's model, which has the host's part of the network."""
        return self.blocks.model


def compile_network(
    network: nengo.Network,
    chip: str | Path = "loihi",
    dt: float = DT_S,
    pipeline: Pipeline | str | None = None,
    observer: Observer = observe_nothing,
    offload: bool = False,
    *,
    settings: BuildSettings = AS_USUAL,
    progress: Progress = silent,
) -> Compilation:
    """Compile a network for a chip.

    Parameters
    ----------
    network : nengo.Network
        The network. If it has no seed, 0 is used. Its attribute ``cures``, if it has one, holds
        cures for refusals, by the id of a rule.
    chip : str or Path
        A chip's name, or the path of its TOML file.
    dt : float
        The time step, in seconds.
    pipeline : Pipeline or str, optional
        The passes, or a text that `spikeport.compile.passes.parse` reads; by default the chip's.
        Without passes, every block has a core of its own, as in nengo-loihi.
    observer : callable
        Called after every pass with the pass and its return value.
    offload : bool
        Move ensembles that break a rule to the host, the smallest first, until the rest compiles.
        The report names them. The network itself is not changed.
    settings : BuildSettings
        nengo-loihi's settings of the build, such as ``pes_error_scale``.
    progress : callable
        Called when a stage begins, see `spikeport.progress.Progress`.

    Raises
    ------
    DoesNotFitError
        If the network breaks rules or exceeds limits of the chip; the error lists all of them.
    NothingOnChipError
        If no ensemble is on the chip, so that there is no image: the network runs on the host.
    CompileError
        If nengo-loihi's builder refuses the network for another reason.
    UsageError, ChipFileError
        If an argument is not valid, chip or passes are not known, or the chip's file is wrong.
    """
    check_arguments(network, chip, dt, pipeline)
    if not isinstance(offload, bool):
        raise ArgumentError("offload", offload, "a bool")
    if not isinstance(settings, BuildSettings):
        raise ArgumentError("settings", settings, "a BuildSettings")
    for name, function in {"observer": observer, "progress": progress}.items():
        if not callable(function):
            raise ArgumentError(name, function, "a function, or leave it out")
    dt = float(dt)
    target, pipeline = targeted(str(chip), pipeline)
    if pipeline.networks:
        settings.check_written()
    stages = Stages(progress, "compiling", _stages(pipeline))
    job = Job(network, target, dt, pipeline, observer, settings, stages)
    with freed_memory.kept(), _own_cures(network):
        return _offloaded(job) if offload else _advised(job)


def check_arguments(network: object, chip: object, dt: object, pipeline: object) -> None:
    """Raise `ArgumentError` if an argument of `compile_network` is not valid."""
    if not isinstance(network, nengo.Network):
        raise ArgumentError("network", network, "a nengo.Network")
    if not isinstance(chip, str | Path):
        expected = "the name of a chip, or the path of its TOML file"
        cure = "; give a time step by keyword, dt=..." if isinstance(chip, float) else ""
        raise ArgumentError("chip", chip, expected + cure)
    if isinstance(dt, bool) or not isinstance(dt, Real) or not 0 < _as_float(dt) < math.inf:
        raise ArgumentError("dt", dt, "a time step in seconds, above 0 and finite")
    if pipeline is not None and not isinstance(pipeline, str | Pipeline):
        raise ArgumentError("pipeline", pipeline, "a Pipeline, its text, or None for the chip's")


def _as_float(number: Real) -> float:
    """Return a number as a float; infinity if it is an integer beyond all floats."""
    try:
        return float(number)
    except OverflowError:
        return math.inf


class Job(NamedTuple):
    """The arguments of a compile, found to be valid."""

    network: nengo.Network
    chip: ChipModel
    dt_s: float
    pipeline: Pipeline
    observer: Observer
    settings: BuildSettings
    stages: Stages


def _stages(passes: Pipeline) -> list[str]:
    """Return the names of the stages of a compile, in order."""
    networks, blocks, images = (
        [one.name for one in some] for some in (passes.networks, passes.blocks, passes.images)
    )
    return [RULES, *networks, BUILD, *blocks, ROUND, *images, VERIFY]


@contextlib.contextmanager
def _own_cures(network: nengo.Network) -> Iterator[None]:
    """Put the cures of a network's own kind, if it has some, into a refusal."""
    try:
        yield
    except DoesNotFitError as error:
        if isinstance(error, NothingOnChipError) or not hasattr(network, "cures"):
            raise
        raise error.with_cures(network.cures) from None


def _advised(job: Job) -> Compilation:
    """Compile the network; add advice on other passes to a refusal."""
    try:
        return _compiled(job)
    except RefusedError as error:
        if not isinstance(error, NothingOnChipError):
            cores_by = functools.partial(_cores_by, job)
            error.advice = advice(job.network, error, job.chip, cores_by, _other_passes(job))
        raise


def _offloaded(job: Job) -> Compilation:
    """Move ensembles that break a rule to the host, and compile the rest."""
    search = Offload(job.network, lambda: _compiled(job))
    try:
        compilation = search.result()
    except NothingOnChipError as nothing:
        nothing.offloaded = search.offloaded({})
        raise
    offloaded = search.offloaded(host_spikes(compilation.model))
    # Ensembles that were moved are on the host as well, but not because a user put them there.
    moved = {one.object for one in offloaded}
    on_host = tuple(one for one in compilation.report.on_host if one.object not in moved)
    report = replace(compilation.report, offloaded=offloaded, on_host=on_host)
    return replace(compilation, report=report)


def _other_passes(job: Job) -> str | None:
    """Return passes that may compile a refused network; None if its settings allow no others.

    A network with cures of its own is of a kind that no pass rewrites.
    """
    if hasattr(job.network, "cures"):
        return None
    if job.pipeline.networks:
        return AS_WRITTEN
    try:
        job.settings.check_written()
    except ArgumentError:
        return None
    return COMPACT


def _cores_by(job: Job, passes: str) -> int:
    """Return the number of cores of a compile with other passes, without an observer."""
    pipeline = parse(passes)
    stages = Stages(silent, "compiling", _stages(pipeline))
    other = job._replace(pipeline=pipeline, observer=observe_nothing, stages=stages)
    with ignored_warnings():
        return len(_compiled(other).report.cores)


class StageValues(NamedTuple):
    """The values of a compile, stage by stage."""

    scope: Scope
    """The network as the user wrote it."""
    rewrite: Rewrite
    blocks: IntegerBlocks
    unplaced: ChipImage
    image: ChipImage
    passes: Sequence[dict[str, object]]
    """The record of each pass."""


def _compiled(job: Job) -> Compilation:
    """Compile the network: each stage turns a value into the next one."""
    chip, begin = job.chip, job.stages.begin
    run = PassRun(job.pipeline, chip, job.dt_s, job.observer, begin)
    scope = Scope(job.network, Names(job.network))
    with collected_warnings() as notices:
        begin(RULES)
        rewrite = _rewritten(job, scope, run)
        with _about_members(rewrite):
            begin(BUILD)
            floats = _built(rewrite, job, run)
            begin(ROUND)
            blocks = discretise(floats)
    unplaced = extract(blocks, chip.name)
    image = run.images(unplaced)
    begin(VERIFY)
    cores = _verified(image, chip, floats, rewrite)
    values = StageValues(scope, rewrite, blocks, unplaced, image, run.record)
    report = _report(job, values, cores, notices.texts())
    return Compilation(image, report, lambda: blocks, rewrite.stand_ins, rewrite.built)


@contextlib.contextmanager
def _about_members(rewrite: Rewrite) -> Iterator[None]:
    """Add the user's ensembles to the objects that a refusal of fused or cut ones is about."""
    try:
        yield
    except DoesNotFitError:
        raise  # its violations have their objects
    except RefusedError as error:
        error.about = tuple(dict.fromkeys((*error.about, *rewrite.unfused(error.about))))
        raise


def _rewritten(job: Job, scope: Scope, run: PassRun) -> Rewrite:
    """Return the rewritten network; check the rules before and after."""
    _refuse_unbuildable(job, scope, run)
    once = each_once(Rewrite(job.network, scope.names))
    passed = run.networks(once)
    if job.settings.remove_passthrough:
        passed = called_once(passed, job.dt_s)
    rewrite = whole_targets(passed, job.dt_s)
    # Check again: a pass may have broken a rule, or mended a violation.
    if broken := lint(rewrite.scope):
        names, of_rules = rewrite.names, {one.object for one in broken}
        objects = [obj for obj in rewrite.network.all_objects if names[obj] in of_rules]
        about = {names[obj]: rewrite.unfused(names.with_ends(obj)) for obj in objects}
        raise DoesNotFitError(job.chip.name, broken, about)
    return rewrite


def _refuse_unbuildable(job: Job, scope: Scope, run: PassRun) -> None:
    """Refuse a network that breaks a rule, or is too large for the chip or for memory."""
    chip = job.chip
    if broken := lint(scope, rewritten=not run.rewrites):
        # A network with nothing for the chip breaks only this rule, and is not faulty.
        only_empty = [one.id for one in broken] == ["SP001"]
        raise (NothingOnChipError if only_empty else DoesNotFitError)(chip.name, broken)
    # Check before the build: building a network that is far too large takes long, and all memory.
    least = 0 if run.rewrites else compartments_at_least(scope, job.settings)
    if much := verify_size(least, chip):
        raise DoesNotFitError(chip.name, much)
    if too_large := over_memory(job.network):
        raise DoesNotFitError(chip.name, too_large)


def _built(rewrite: Rewrite, job: Job, run: PassRun) -> FloatBlocks:
    """Return the blocks of a network, after the passes over blocks."""
    floats = build(rewrite, job.dt_s, job.settings)
    if broken := list(split_learning(floats)):
        about = {one.object: rewrite.unfused(floats.about(one.object)) for one in broken}
        raise DoesNotFitError(job.chip.name, broken, about)
    return run.blocks(floats)


def _verified(
    image: ChipImage, chip: ChipModel, floats: FloatBlocks, rewrite: Rewrite
) -> list[CoreUse]:
    """Return the use of every core; raise an error if a limit of the chip is exceeded."""
    cores = core_uses(image, chip)
    exceeded = [*verify(cores, chip), *verify_settings(image, chip)]
    exceeded += [*verify_refractory(image), *verify_learning(image, chip)]
    if exceeded:
        raise DoesNotFitError(chip.name, exceeded, _owners(image, floats, rewrite))
    return cores


def _owners(image: ChipImage, floats: FloatBlocks, rewrite: Rewrite) -> dict[str, tuple[str, ...]]:
    """Return the names of the user's objects on each core; a connection adds those of its ends."""
    owners: dict[str, tuple[str, ...]] = {}
    for core, block in zip(image.blocks.core, image.manifest.blocks, strict=True):
        label = image.cores[core]
        about = rewrite.unfused(floats.about(block.owner))
        owners[label] = (*owners.get(label, ()), *about)
    return owners


def _report(
    job: Job, values: StageValues, cores: Sequence[CoreUse], warnings: tuple[str, ...]
) -> Report:
    """Return the report on a network that fits."""
    chip, image = job.chip, values.image
    return Report(
        chip,
        image.digest,
        tuple(cores),
        values.blocks.errors,
        warnings,
        placed=_placed(image),
        passes=tuple(values.passes),
        lower_bound=lower_bound(block_loads(image, chip), capacity(chip)),
        neurobench=neurobench(image, cores),
        hints=_hints(job, values),
        on_host=_on_host(values.scope),
        host=host_traffic(image, chip),
    )


def _placed(image: ChipImage) -> tuple[tuple[str, ...], ...]:
    """Return the names of the blocks on each core, as nengo-loihi built them."""
    names: list[list[str]] = [[] for _ in range(image.n_cores)]
    for core, block in zip(image.blocks.core, image.manifest.blocks, strict=True):
        names[core].append(block.built)
    return tuple(tuple(dict.fromkeys(mine)) for mine in names)


def _hints(job: Job, values: StageValues) -> tuple[Violation, ...]:
    """Return the hints on a network, on what was built of it, and on the image before placing."""
    dt_s, rewritten = job.dt_s, bool(job.pipeline.networks)
    scope, blocks, unplaced = values.scope, values.blocks, values.unplaced
    built = {**blocks.model.params, **values.rewrite.built}
    return (
        *network_hints(scope, job.settings.remove_passthrough),
        *loop_hints(scope),
        *host_loop_hints(scope, dt_s),
        *host_neuron_hints(scope, dt_s),
        *learning_rate_hints(scope),
        *unlearnt_hints(unplaced),
        *single_spike_hints(unplaced),
        *filter_hints(blocks.floats.passages, dt_s, rewritten),
        *image_hints(unplaced, blocks.errors, blocks.rounded_away, rewritten),
        *overflow_hints(unplaced),
        *saturation_hints(scope, built, dt_s),
        *cut_off_hints(job.network, values.rewrite, job.settings.remove_passthrough),
        *path_hints(scope, any(one.name == "decode_path" for one in job.pipeline.networks)),
        *relay_hints(values.passes),
    )


def _on_host(scope: Scope) -> tuple[OnHost, ...]:
    """Return the ensembles that are not meant for the chip."""
    reasons = ((one, scope.off_chip(one)) for one in dict.fromkeys(scope.network.all_ensembles))
    return tuple(OnHost(scope.names[one], one.n_neurons, why) for one, why in reasons if why)
