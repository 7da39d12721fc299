"""The findings on a compile: its costs at stated rates or in a run, and hints on its passes."""

from dataclasses import dataclass, replace

import nengo

from spikeport.backends.loss import measure, network_error
from spikeport.commands.against_written import as_written, is_rewritten, more_cores, more_loss
from spikeport.commands.screen import Findings
from spikeport.compile.image.expected import Rates, expected_activity
from spikeport.compile.image.modules import by_module, modules
from spikeport.compile.pipeline import Compilation
from spikeport.compile.report.report import Modules
from spikeport.fresh_copy import fresh_copy
from spikeport.progress import Progress

SEED = 0
"""Seed of processes on the host while a loss is measured."""


@dataclass(frozen=True)
class Compiled:
    """A network and its compile, with the rates that a user states, or the time of a run.

    Attributes
    ----------
    network : nengo.Network
        The network.
    compilation : Compilation
        Its compile.
    chip, passes : str
        The chip and the passes of the compile.
    rates : Rates or None
        The rates that costs are estimated at.
    loss_s : float or None
        The time of a run, in s, in which costs and losses are measured.
    """

    network: nengo.Network
    compilation: Compilation
    chip: str
    passes: str
    rates: Rates | None
    loss_s: float | None


def findings_on(compiled: Compiled, progress: Progress) -> Findings:
    """Return the findings on a compile, with hints from a compile of the network as written."""
    rewritten = is_rewritten(compiled.network, compiled.passes)
    beside = compiled.network
    if compiled.loss_s is None:
        findings = _reckoned(compiled)
    else:
        # The run leaves a state in the functions that it calls, and the run of the network as
        # written has to begin without one.
        beside = fresh_copy(compiled.network) if rewritten else compiled.network
        findings = _measured(compiled, compiled.loss_s, progress)
    # On one core a pipeline cannot take more cores than another, but it may lose more.
    if not rewritten or (compiled.loss_s is None and compiled.compilation.image.n_cores == 1):
        return findings
    progress("compiling as written", None)
    return _compared(findings, replace(compiled, network=beside))


def _reckoned(compiled: Compiled) -> Findings:
    """Return the findings without a run; if rates are stated, with the costs at these rates."""
    report, image, rates = compiled.compilation.report, compiled.compilation.image, compiled.rates
    if rates is None:
        return Findings(report)
    counts = Modules(modules(image), expected_activity(by_module(image), rates))
    return Findings(report, expected_activity(image, rates), rates, modules=counts)


def _measured(compiled: Compiled, seconds: float, progress: Progress) -> Findings:
    compilation = compiled.compilation
    measured = measure(compiled.network, compilation, seconds, SEED, progress)
    counts = Modules(modules(compilation.image), measured.by_module)
    return Findings(compilation.report, measured.activity, loss=measured.loss, modules=counts)


def _compared(findings: Findings, compiled: Compiled) -> Findings:
    """Return the findings, with hints if the network takes or loses more than as written."""
    written = as_written(compiled.network, compiled.chip, compiled.passes)
    if written is None:
        return findings
    hints = [*findings.report.hints, *more_cores(compiled.compilation, written)]
    if findings.loss is not None and compiled.loss_s is not None:
        usual = network_error(compiled.network, written, compiled.loss_s, SEED)
        hints += more_loss(findings.loss.network_error, usual)
    return replace(findings, report=replace(findings.report, hints=tuple(hints)))
