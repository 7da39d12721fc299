"""``spikeport compile``."""

from dataclasses import replace
from pathlib import Path

import nengo

from spikeport.backends.attempt import attempt
from spikeport.commands import nir, rates
from spikeport.commands.checks import check_seconds
from spikeport.commands.console import line_console
from spikeport.commands.findings import Compiled, findings_on
from spikeport.commands.options_of_networks import CompileRequest
from spikeport.commands.passes import printer
from spikeport.commands.progress import progress_bar
from spikeport.commands.screen import show_findings, show_nothing
from spikeport.compile.check.violation import NothingOnChipError, OverBudgetError
from spikeport.compile.ground.refusal import RefusedError
from spikeport.compile.image.expected import Rates
from spikeport.compile.passes.parse import targeted
from spikeport.compile.passes.pipeline import Observer
from spikeport.compile.pipeline import Compilation, compile_network
from spikeport.compile.report.budget import Budget
from spikeport.compile.report.refusal import refused_report
from spikeport.compile.report.report import Report
from spikeport.constants import DT_S
from spikeport.errors import UsageError
from spikeport.find_network import find_network, needed_passes, parts
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.chip import ChipModel
from spikeport.progress import Progress
from spikeport.simulation.probes import outputs, probing_outputs
from spikeport.simulator import Simulator
from spikeport.user_code import contained


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
            if played is not None:
                print("--spikes: not compared, since nothing of the graph is on the chip")
            return
        except RefusedError as error:
            request.to.write_refusal(refused_report(chip, error).to_dict(), request.network)
            raise
        compiled = Compiled(network, compilation, request.chip, passes, stated, request.loss_s)
        findings = findings_on(compiled, progress)
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
            line_console(stderr=True).print(f"note: {unknown}")
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
