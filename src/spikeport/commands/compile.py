"""``spikeport compile``."""

from dataclasses import replace
from pathlib import Path

import nengo

from spikeport.backends.attempt import attempt
from spikeport.backends.loss import measure, network_error
from spikeport.commands import nir, rates
from spikeport.commands.against_written import as_written, is_rewritten, more_cores, more_loss
from spikeport.commands.checks import check_seconds
from spikeport.commands.console import Console
from spikeport.commands.options_of_networks import CompileRequest
from spikeport.commands.passes import printer
from spikeport.commands.progress import progress_bar
from spikeport.commands.screen import Findings, show_findings, show_nothing
from spikeport.compile.check.violation import NothingOnChipError, OverBudgetError
from spikeport.compile.ground.refusal import RefusedError
from spikeport.compile.image.expected import Rates, expected_activity
from spikeport.compile.image.modules import by_module, modules
from spikeport.compile.passes.parse import targeted
from spikeport.compile.passes.pipeline import Observer
from spikeport.compile.pipeline import Compilation, compile_network
from spikeport.compile.report.budget import Budget
from spikeport.compile.report.refusal import refused_report
from spikeport.compile.report.report import Modules, Report
from spikeport.constants import DT_S
from spikeport.errors import UsageError
from spikeport.find_network import find_network, needed_passes, parts
from spikeport.fresh_copy import fresh_copy
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.chip import ChipModel
from spikeport.progress import Progress
from spikeport.simulation.probes import outputs, probing_outputs
from spikeport.simulator import Simulator
from spikeport.user_code import contained

SEED = 0
"""Seed of processes on the host while a loss is measured."""


def run(request: CompileRequest) -> None:
    """Compile, write the requested files, print the report, and check it against the budget."""
    budget = request.limits.budget()
    stated = _checked_rates(request, budget)
    where, _ = parts(request.network)
    request.to.check(Path(where))
    settings = nir.with_dt(request.network, request.settings, request.dt_s, request.spikes)
    passes = _passes(request)
    chip, pipeline = targeted(request.chip, passes)
    observer = printer(request.print_after, pipeline)
    with contained(request.network), progress_bar() as progress:
        progress("building the network", None)
        network = find_network(
            request.network, settings, request.chip, request.passes, request.build_timeout_s
        )
        played = nir.read_spikes(network, request.spikes)
        try:
            compilation = _compilation(network, request, passes, observer, progress)
        except NothingOnChipError as nothing:
            progress("building on the host", None)
            _check_host(network, request.chip, passes)
            _write_nothing(chip, nothing, request)
            return
        except RefusedError as error:
            request.to.write_refusal(refused_report(chip, error).to_dict(), request.network)
            raise
        findings = _findings(network, compilation, request, passes, stated, progress)
    # An error comes last: the compile is shown and written all the same.
    exceeded, unknown = budget.exceeded(findings.report, findings.activity)
    findings = replace(findings, report=replace(findings.report, over_budget=tuple(exceeded)))
    with request.to.alone():
        request.to.write_image(compilation.image)
        request.to.write_report(findings.to_dict(), request.network)
    show_findings(findings, request.cores)
    nir.show(network, compilation, played)
    request.to.note()
    if exceeded:
        if unknown is not None:
            Console(stderr=True, soft_wrap=True, highlight=False).print(f"note: {unknown}")
        raise OverBudgetError(exceeded)
    if unknown is not None:
        raise unknown


def _passes(request: CompileRequest) -> str:
    """Return the passes: the user's, else the ones that the network needs, else the chip's."""
    passes = request.passes if request.passes is not None else needed_passes(request.network)
    return chips.get(request.chip).pipeline if passes is None else passes


def _compilation(
    network: nengo.Network,
    request: CompileRequest,
    passes: str,
    observer: Observer,
    progress: Progress,
) -> Compilation:
    """Compile the network; add probes if a loss is to be measured and nothing is probed."""

    def work() -> Compilation:
        return compile_network(
            network, request.chip, DT_S, passes, observer, request.offload, progress=progress
        )

    # A loss is measured at the values that are read out.
    if request.loss_s is not None and not network.all_probes and any(outputs(network)):
        return probing_outputs(network, work)
    return work()


def _check_host(network: nengo.Network, chip: str, passes: str) -> None:
    """Build a network without a chip, as a run would; raises BackendError if Nengo refuses it."""

    def build() -> None:
        Simulator(network, chip, "reference", pipeline=passes).close()

    attempt("before step 1 on reference", build)


def _write_nothing(chip: ChipModel, nothing: NothingOnChipError, request: CompileRequest) -> None:
    """Write a report without cores, and say why there is no image."""
    report = Report(chip, "", (), (), (), hints=nothing.violations, offloaded=nothing.offloaded)
    with request.to.alone():
        request.to.remove_image()
        request.to.write_report(report.to_dict(), request.network)
    show_nothing(report, nothing.verdict)
    request.to.note()


def _checked_rates(request: CompileRequest, budget: Budget) -> Rates | None:
    """Return the rates that costs are estimated at; UsageError for options that contradict them."""
    stated = rates.parse(request.rates)
    if stated is not None and request.loss_s is not None:
        raise UsageError("--rate-hz and --loss: the run of --loss has rates of its own; give one")
    if request.loss_s is not None:
        check_seconds("--loss", request.loss_s)
    nir.check_loss(request.network, request.loss_s, request.spikes)
    budget.check_basis(stated is not None or request.loss_s is not None)
    return stated


def _findings(
    network: nengo.Network,
    compilation: Compilation,
    request: CompileRequest,
    passes: str,
    stated: Rates | None,
    progress: Progress,
) -> Findings:
    """Return the findings on a compile, with hints from a compile of the network as written."""
    rewritten = is_rewritten(network, passes)
    beside = network
    if request.loss_s is None:
        findings = _reckoned(compilation, stated)
    else:
        # The run leaves a state in the functions that it calls, and the run of the network as
        # written has to begin without one.
        beside = fresh_copy(network) if rewritten else network
        findings = _measured(network, compilation, request.loss_s, progress)
    # On one core a pipeline cannot take more cores than another, but it may lose more.
    if not rewritten or (request.loss_s is None and compilation.image.n_cores == 1):
        return findings
    progress("compiling as written", None)
    written = as_written(beside, request.chip, passes)
    return _compared(findings, beside, compilation, written, request.loss_s)


def _reckoned(compilation: Compilation, stated: Rates | None) -> Findings:
    """Return the findings without a run; if rates are stated, with the costs at these rates."""
    if stated is None:
        return Findings(compilation.report)
    image = compilation.image
    counts = Modules(modules(image), expected_activity(by_module(image), stated))
    return Findings(compilation.report, expected_activity(image, stated), stated, modules=counts)


def _measured(
    network: nengo.Network, compilation: Compilation, seconds: float, progress: Progress
) -> Findings:
    measured = measure(network, compilation, seconds, SEED, progress)
    counts = Modules(modules(compilation.image), measured.by_module)
    return Findings(compilation.report, measured.activity, loss=measured.loss, modules=counts)


def _compared(
    findings: Findings,
    network: nengo.Network,
    compilation: Compilation,
    written: Compilation | None,
    loss_s: float | None,
) -> Findings:
    """Return the findings, with hints if the network takes or loses more than as written."""
    if written is None:
        return findings
    hints = [*findings.report.hints, *more_cores(compilation, written)]
    if findings.loss is not None and loss_s is not None:
        usual = network_error(network, written, loss_s, SEED)
        hints += more_loss(findings.loss.network_error, usual)
    return replace(findings, report=replace(findings.report, hints=tuple(hints)))
