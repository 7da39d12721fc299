"""``spikeport convert``."""

import contextlib
from collections.abc import Iterator

from spikeport.atomic import check_apart, check_output
from spikeport.commands.console import Console
from spikeport.commands.conversion_report import (
    CONVERSION,
    POLICY,
    lint_lines,
    lint_table,
    write_conversion,
)
from spikeport.commands.options_of_networks import ConvertRequest
from spikeport.commands.policy_file import file_of, in_words, observations_of, read_policy
from spikeport.commands.progress import progress_bar
from spikeport.commands.screen import Findings, show_findings
from spikeport.compile.check.violation import DoesNotFitError
from spikeport.compile.ground.refusal import RefusedError
from spikeport.compile.passes.parse import parse
from spikeport.compile.report.refusal import refused_report
from spikeport.errors import UsageError
from spikeport.experiments.policy.conversion import PASSES, Conversion, convert
from spikeport.hardware_models import chip as chips
from spikeport.networks.perceptron import options_for


def run(request: ConvertRequest) -> None:
    """Convert a policy, write the requested files, and print lint and report."""
    _check(request)
    with progress_bar() as progress:
        progress("reading the policy", None)
        walker, mlp = read_policy(request)
        observations = observations_of(request, walker, mlp)
        options = options_for(mlp, request.n_neurons, request.tau_fwd)
        conversion = Conversion(mlp, options, observations.values, request.seed)
        with _refusal_reported(request):
            converted = convert(conversion, request.chip, _passes(request), progress)
    findings = Findings(converted.compilation.report, converted.activity)
    with request.to.alone():
        request.to.write_image(converted.compilation.image)
        request.to.write_report(findings.to_dict(), str(request.file))
        if (out := request.to.out) is not None:
            write_conversion(out, converted.lint, walker)
    console = Console(highlight=False)
    console.print(f"policy: {', '.join(in_words(request, mlp))}")
    console.print(f"observations: {observations.origin}")
    console.print(lint_table(converted.lint))
    for line in lint_lines(converted.lint):
        console.print(line)
    show_findings(findings, cores=False)
    request.to.note()


@contextlib.contextmanager
def _refusal_reported(request: ConvertRequest) -> Iterator[None]:
    """Write the report on a policy that is refused, and add advice for its owner."""
    try:
        yield
    except RefusedError as error:
        if isinstance(error, DoesNotFitError):
            error.advice = _smaller(request.n_neurons)
        report = refused_report(chips.get(request.chip), error)
        request.to.write_refusal(report.to_dict(), str(request.file))
        raise


def _check(request: ConvertRequest) -> None:
    if request.n_neurons < 2 or request.n_neurons % 2:
        raise UsageError(
            f"--neurons {request.n_neurons}: a unit has half its neurons for each sign; use an "
            "even number, 2 or more"
        )
    if not 0 < request.tau_fwd < 1:
        raise UsageError(f"--tau-fwd {request.tau_fwd:g}: a filter must be above 0 and below 1 s")
    reads = [file_of(request), *filter(None, (request.observations, request.description))]
    request.to.check(*reads)
    if (out := request.to.out) is not None:
        check_output("--out", out / POLICY, *reads)
        named = {"--json": request.to.json, "--html": request.to.html}
        asked = [(option, path) for option, path in named.items() if path is not None]
        check_apart([("--out", out / POLICY), ("--out", out / CONVERSION), *asked])
    chips.get(request.chip)
    parse(_passes(request))


def _passes(request: ConvertRequest) -> str:
    """Return the passes, by default those for a policy."""
    return PASSES if request.passes is None else request.passes


def _smaller(n_neurons: int) -> str:
    """Return advice for the owner of a policy, who has no ensembles to change."""
    if n_neurons == 2:
        return "more: -n 2 is the least; use a policy with fewer units"
    return f"more: try -n {n_neurons // 4 * 2}, fewer neurons for each unit than {n_neurons}"
