"""``spikeport convert``."""

import contextlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from spikeport.atomic import check_apart, check_output
from spikeport.commands.console import Console, Table
from spikeport.commands.destinations import Destinations
from spikeport.commands.progress import progress_bar
from spikeport.commands.screen import Findings, show_findings
from spikeport.compile.check.violation import DoesNotFitError
from spikeport.compile.ground.refusal import RefusedError
from spikeport.compile.passes.parse import parse
from spikeport.compile.report.refusal import refused_report
from spikeport.errors import UsageError, unknown
from spikeport.experiments.policy.conversion import PASSES, Conversion, convert
from spikeport.experiments.policy.lint import ConversionLint
from spikeport.experiments.policy.observations import (
    Observations,
    normal_observations,
    read_observations,
)
from spikeport.files import read_json, write_json
from spikeport.hardware_models import chip as chips
from spikeport.networks.loading.files import file_format, load_mlp
from spikeport.networks.loading.mlp import Mlp
from spikeport.networks.loading.walking import our_observations
from spikeport.networks.perceptron import options_for
from spikeport.networks.walking_policy import POLICIES, WalkingPolicy

POLICY = "policy.npz"
"""The file of a walking policy, in the folder of its conversion."""
CONVERSION = "conversion.json"
"""The file of a conversion's errors in that folder."""
WALKER = "walking_policy"
"""Its key that is true if a walking policy was written beside it."""


@dataclass(frozen=True, kw_only=True)
class ConvertRequest:
    """A conversion of a policy, as the user asked for it."""

    file: Path
    description: Path | None
    observations: Path | None
    activation: str | None
    output: str | None
    n_neurons: int
    tau_fwd: float
    chip: str
    passes: str | None
    seed: int
    to: Destinations

    @property
    def policy(self) -> Path:
        """The file of the policy, which may be given by the name of a shipped policy."""
        if (shipped := POLICIES.get(str(self.file))) is not None:
            return shipped
        if not (self.file.suffix or self.file.exists()):
            raise unknown("policy", str(self.file), (*POLICIES, "the path of a file"))
        return self.file

    @property
    def pipeline(self) -> str:
        """The passes, by default those for a policy."""
        return PASSES if self.passes is None else self.passes


def run(request: ConvertRequest) -> None:
    """Convert a policy, write the requested files, and print lint and report."""
    _check(request)
    with progress_bar() as progress:
        progress("reading the policy", None)
        walker, mlp = _read(request)
        observations = _observations(request, walker, mlp)
        options = options_for(mlp, request.n_neurons, request.tau_fwd)
        conversion = Conversion(mlp, options, observations.values, request.seed)
        with _refusal_reported(request):
            converted = convert(conversion, request.chip, request.pipeline, progress)
    findings = Findings(converted.compilation.report, converted.activity)
    with request.to.alone():
        request.to.write_image(converted.compilation.image)
        request.to.write_report(findings.to_dict(), str(request.file))
        if (out := request.to.out) is not None:
            _write(out, converted.lint, walker)
    console = Console(highlight=False)
    console.print(f"policy: {', '.join(_in_words(request, mlp))}")
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
    reads = [one for one in (request.policy, request.observations, request.description) if one]
    request.to.check(*reads)
    if (out := request.to.out) is not None:
        check_output("--out", out / POLICY, *reads)
        named = {"--json": request.to.json, "--html": request.to.html}
        asked = [(option, path) for option, path in named.items() if path is not None]
        check_apart([("--out", out / POLICY), ("--out", out / CONVERSION), *asked])
    chips.get(request.chip)
    parse(request.pipeline)


def _write(out: Path, lint: ConversionLint, walker: WalkingPolicy | None) -> None:
    """Write the errors of a conversion and a walking policy, in place of an earlier conversion."""
    if walker is not None:
        walker.save(out / POLICY)
    elif _wrote_policy(out / CONVERSION):  # otherwise the file is the user's own
        (out / POLICY).unlink(missing_ok=True)
    write_json(out / CONVERSION, {**asdict(lint), WALKER: walker is not None})


def _wrote_policy(conversion: Path) -> bool:
    """Return whether an earlier conversion wrote a walking policy beside this file."""
    try:
        held = read_json(conversion)
    except UsageError:
        return False
    return isinstance(held, dict) and held.get(WALKER) is True


def _smaller(n_neurons: int) -> str:
    """Return advice for the owner of a policy, who has no ensembles to change."""
    if n_neurons == 2:
        return "more: -n 2 is the least; use a policy with fewer units"
    return f"more: try -n {n_neurons // 4 * 2}, fewer neurons for each unit than {n_neurons}"


def _read(request: ConvertRequest) -> tuple[WalkingPolicy | None, Mlp]:
    """Return the walking policy, if the file holds one, and the layers."""
    if request.description is None and file_format(request.policy) != "npz":
        return None, load_mlp(request.policy, request.activation, request.output)
    from spikeport.experiments.policy.settings import load_policy  # needs the robot

    walker = load_policy(
        request.policy, request.description, request.activation, output=request.output
    )
    return walker, Mlp(walker.layers, "elu")


def _in_words(request: ConvertRequest, mlp: Mlp) -> Iterator[str]:
    """Yield sizes, activation and ends of a policy; the user may have to correct the activation."""
    yield "-".join(map(str, mlp.sizes))
    is_guess = request.activation is None and file_format(request.policy) == "checkpoint"
    hint = " (assumed: a checkpoint names none; give it with --activation)" if is_guess else ""
    yield mlp.activation + hint
    if mlp.observed is not None:
        yield "clip of the observation"
    if mlp.squash is not None:
        yield f"{mlp.squash.words} of the action"


def _observations(request: ConvertRequest, walker: WalkingPolicy | None, mlp: Mlp) -> Observations:
    if request.observations is not None:
        found = read_observations(request.observations, mlp.sizes[0])
        return found if walker is None else _translated(found, request)
    if walker is None:
        return normal_observations(mlp)
    from spikeport.experiments.walk.gait import record_gait

    gait = record_gait(walker)
    return Observations(gait, f"{len(gait):,} of a gait, recorded from the exact policy")


def _translated(found: Observations, request: ConvertRequest) -> Observations:
    """Return observations of a walking policy in our order of joints, as its layers are."""
    from spikeport.experiments.policy.settings import H1  # needs the robot

    described = request.description
    values = our_observations(found.values, H1, request.policy, described)
    origin = found.origin if described is None else f"{found.origin}, in the order of {described}"
    return Observations(values, origin)


def lint_table(lint: ConversionLint) -> Table:
    """Return the table of the conversion's errors, layer by layer."""
    table = Table("layer", title="conversion, in float spikes")
    table.add_numbers("units", "range", "/ rms", "rate Hz", "tau ms", "spikes", "error")
    for one in lint.layers:
        table.add_row(
            one.name,
            f"{one.n_units}",
            f"{0 - one.below:.2g} .. {one.above:.2g}",  # 0 has no sign then
            "-" if one.spread is None else f"{one.spread:.1f}",
            f"{one.rate_hz:.0f}",
            f"{1000 * one.tau_s:g}",
            f"{one.spikes:.2g}",
            _percent(one.error),
        )
    return table


def _percent(error: float | None) -> str:
    return "-" if error is None else f"{100 * error:.1f} %"


def lint_lines(lint: ConversionLint) -> Iterator[str]:
    """Yield the errors of the action, and hints on changes that may help."""
    in_float, on_chip = map(_percent, (lint.action_error, lint.chip_error))
    yield f"action: {in_float} off in float spikes, {on_chip} on the chip"
    for hint in lint.hints():
        yield f"hint: {hint}"
