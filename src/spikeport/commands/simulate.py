"""``spikeport simulate``: a user's network on a chip, beside float Nengo."""

import sys
import warnings
from pathlib import Path
from types import ModuleType
from typing import Any

import nengo

from spikeport.backends import registry as backends
from spikeport.backends.board.link import LinkOptions
from spikeport.commands import nir
from spikeport.commands.checks import (
    check_counts,
    check_seconds,
    check_target,
    refuse_compile_options,
)
from spikeport.commands.console import Console, ScreenTable
from spikeport.commands.ending import ended_in_order
from spikeport.commands.options_of_networks import SimulateRequest
from spikeport.commands.progress import progress_bar
from spikeport.commands.screen import print_costs, print_hints, print_on_host, print_written
from spikeport.commands.tables import resource_table
from spikeport.compile.check.lost_values import hints_after
from spikeport.compile.report.report import in_result
from spikeport.compile.report.summary import verdict
from spikeport.constants import DT_S
from spikeport.counted import percent
from spikeport.errors import UsageError
from spikeport.experiments import registry, run_folder, watching
from spikeport.experiments.digests import check_unchanged, digests_of_present
from spikeport.experiments.link_lines import link_line
from spikeport.find_network import BUILT_IN, NIR, find_network, parts
from spikeport.hardware_models import chip as chips
from spikeport.plots import rendered
from spikeport.simulation.probes import probing_outputs
from spikeport.simulation.run import FLOAT, Ran, SimulationOptions, Watch, run, unwatched
from spikeport.user_code import FILES, contained

FIGURE, DATASET = "spikeport.simulation.figure", "spikeport.simulation.dataset"
"""The modules that need the extra `runs`."""


def simulate(request: SimulateRequest, link: LinkOptions) -> None:
    """Run the network, write its folder, and print its errors relative to float Nengo."""
    _check(request)
    what = "spikeport simulate"
    # Before the work: a missing package ends a run here, and not when it has its results.
    drawing, series = (registry.imported(what, module, "runs") for module in (FIGURE, DATASET))
    with (
        ended_in_order(),
        run_folder.opened(request.out, _stem(request.network), request.overwrite) as folder,
        run_folder.counting(request.counts) as counts,
    ):
        run_folder.check_outside(folder, "--record", link.record)
        with contained(request.network), progress_bar() as progress:
            progress("building the network", None)
            files = digests_of_present(_files(request))
            network = _network(request)
            check_unchanged(files)
            played = nir.play(network, request.spikes)
            options = _options(request, link, counts)
            watch = _viewers(folder, options, series)

            def work() -> Ran:
                with warnings.catch_warnings():
                    # A simulator warns of lost values as it closes: `_show` has them as hints.
                    warnings.filterwarnings("ignore", r"SP\d+ ")
                    return run(network, options, progress, watch)

            ran = work() if network.all_probes else probing_outputs(network, work)
            progress("writing", None)
            with run_folder.renewed(folder) as new:
                _write(new, request, ran, drawing, series)
                run_folder.add_counts(new, counts)
                run_folder.write_result(new, _result(request, ran, network, files))
        _show(ran, network, played, folder)


def _check(request: SimulateRequest) -> None:
    """Raise UsageError for an impossible request before the work, not after it."""
    if request.network in BUILT_IN:
        raise UsageError(
            f"{request.network} is run with its robot, as an experiment: "
            f"spikeport run {BUILT_IN[request.network]}"
        )
    check_seconds("--seconds", request.seconds)
    backend = backends.get(request.backend)
    check_target(request.target)
    if backend.name == FLOAT:
        refuse_compile_options(request.target, request.offload)
    check_counts(request.counts, request.target)


def _stem(spec: str) -> str:
    """Return the name of a run's folder: the name of the file or the module."""
    where, _ = parts(spec)
    is_file = where.endswith((*FILES, NIR))
    # The name of a module may have dots.
    return (Path(where).stem if is_file else where.rpartition(".")[2]) or "network"


def _files(request: SimulateRequest) -> list[Path]:
    """Return the files that the request may name: network, chip and spikes.

    A module, or spikes drawn at random, are no files.
    """
    where, _ = parts(request.network)
    spikes = [] if request.spikes is None else [Path(request.spikes)]
    return [Path(where), *chips.files_of(request.chip), *spikes]


def _network(request: SimulateRequest) -> nengo.Network:
    settings = nir.with_dt(request.network, request.settings, request.dt_s, request.spikes)
    return find_network(request.network, settings, request.chip, None, request.build_timeout_s)


def _options(request: SimulateRequest, link: LinkOptions, counts: Path | None) -> SimulationOptions:
    return SimulationOptions(
        steps=round(request.seconds / DT_S),
        backend=request.backend,
        chip=request.chip,
        pipeline=request.passes,
        offload=request.offload,
        seed=request.seed,
        beside_float=request.beside_float,
        link=link,
        counts=counts,
    )


def _viewers(folder: Path, options: SimulationOptions, series: ModuleType) -> Watch:
    """Return the function that answers viewers of a run; a run in real time has no time for it."""
    if options.link.real_time:
        return unwatched
    return lambda recorded: watching.answer(
        folder, lambda: series.dataset(recorded(), options.backend)
    )


def _write(
    folder: Path,
    request: SimulateRequest,
    ran: Ran,
    drawing: ModuleType,
    series: ModuleType,
) -> None:
    """Write time series, figure and report of a run into its folder."""
    picture = rendered(drawing.figure(ran.recorded, ran.backend, request.network))
    run_folder.write_probes(folder, series.dataset(ran.recorded, ran.backend))
    run_folder.write_figure(folder, picture)
    if ran.report_json is not None:
        run_folder.write_report(folder, ran.report_json, request.network)


def _result(
    request: SimulateRequest, ran: Ran, network: nengo.Network, files: dict[str, str]
) -> dict[str, Any]:
    """Return the content of ``result.json``."""
    errors = {name: one.error() for name, one in ran.recorded.items()}
    delays = {name: one.best_delay() for name, one in ran.recorded.items()}
    known = [error for error in errors.values() if error is not None]
    return {
        "command": ["spikeport", *sys.argv[1:]],
        "model": request.network,
        "backend": ran.backend,
        "seconds": request.seconds,
        "seeds": {"run": request.seed, "network": network.seed},
        "settings": request.settings,
        "files": files,
        "metrics": {
            "errors": errors,
            "delays_s": {name: late and late[0] for name, late in delays.items()},
            "errors_without_delays": {name: late and late[1] for name, late in delays.items()},
            "largest_error": max(known, default=None),
            "real_time_factor": request.seconds / ran.wall_s,
        },
        "activity": ran.activity.totals(),
        "link": ran.link,
        **in_result(ran.report_json),
    }


def _show(ran: Ran, network: nengo.Network, played: str | None, folder: Path) -> None:
    console = Console(highlight=False)
    if ran.report is not None:
        console.print(resource_table(ran.report))
        print_costs(console, ran.report, ran.activity)
    console.print(_probe_table(ran))
    if ran.link is not None:
        console.print(link_line(ran.link), soft_wrap=True)
    if ran.report is not None:
        print_on_host(console, ran.report)
        print_hints(console, ran.report, hints_after(ran.activity, ran.report.hints))
        console.print(verdict(ran.report))
        nir.show_differences(network, ran.report)
    if played is not None:
        console.print(played, soft_wrap=True)
    print_written(console, folder)


def _probe_table(ran: Ran) -> ScreenTable:
    """Return the table of probes, with the rms of their float values, and their relative errors."""
    beside = any(one.values_float is not None for one in ran.recorded.values())
    title = f"probes on {ran.backend}" + ", beside float Nengo" * beside
    table = ScreenTable("probe", title=title)
    table.add_numbers("values", "samples", "rms", "error", "delay", "error, delay removed")
    for name, one in ran.recorded.items():
        n_samples, size = one.values.shape
        late = one.best_delay()
        texts = ("", "") if late is None else (f"{1000 * late[0]:.0f} ms", percent(late[1]))
        rms = one.rms_float()
        scale = "-" if rms is None else f"{rms:.2g}"
        columns = (f"{size:,}", f"{n_samples:,}", scale, percent(one.error()), *texts)
        table.add_row(name, *columns)
    return table
