"""The sentences of the documents that have figures, made from the results of `figure_runs`.

A statement is a function that takes the results of runs by their names, and yields sentences, or
rows of tables, as they must stand in its document but for where lines end.
"""

import inspect
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from statistics import fmean, median
from typing import Any, NamedTuple

from figure_runs import SECONDS, SHAPES, SIZES

Results = list[dict[str, Any]]
"""The results of a run: one result, or one for each point of a sweep."""
Makes = Callable[..., Iterator[str]]


class Stated(NamedTuple):
    """Sentences of a document.

    Attributes
    ----------
    document : str
        Its path in the repository.
    makes : callable
        Yields the sentences from the results of the runs that its arguments name.
    """

    document: str
    makes: Makes

    @property
    def name(self) -> str:
        """The name of the function."""
        return str(self.makes.__name__)

    @property
    def runs(self) -> tuple[str, ...]:
        """The names of the runs."""
        return tuple(inspect.signature(self.makes).parameters)

    def sentences(self, results: Mapping[str, Results]) -> Iterator[str]:
        """Yield the sentences as results make them."""
        return self.makes(*(results[name] for name in self.runs))


STATED: list[Stated] = []


def states(document: str) -> Callable[[Makes], Makes]:
    """Return a decorator that adds a function to the statements of a document."""

    def add(makes: Makes) -> Makes:
        STATED.append(Stated(document, makes))
        return makes

    return add


# parts of results


def values(results: Results, place: str, **settings: object) -> list[Any]:
    """Return what is at a place, such as ``metrics.reaches``, in results with these settings."""
    chosen = [one for one in results if settings.items() <= one["settings"].items()]
    return [_part(one, place) for one in sorted(chosen, key=_seeds)]


def _seeds(result: dict[str, Any]) -> tuple[int, int]:
    return result["seeds"]["run"], result["seeds"]["network"]


def _part(result: Any, place: str) -> Any:
    for key in place.split("."):
        result = result[key]
    return result


def _no_falls(results: Results) -> None:
    """Raise a ValueError if a robot fell, as a statement does not say."""
    if fell := sum(values(results, "metrics.falls")):
        raise ValueError(f"robots fell in {len(results)} runs: {fell}")


def _only(results: Iterable[Any], what: str) -> Any:
    """Return the single one of some results or values; ValueError if there are more or none."""
    found = list(results)
    if len(found) != 1:
        raise ValueError(f"{what}: one is expected, there are {len(found)}")
    return found[0]


def joined(numbers: Iterable[float], digits: int = 0, by: str = " ", times: float = 1) -> str:
    """Return numbers in a row."""
    return by.join(f"{times * number:,.{digits}f}" for number in numbers)


def span(numbers: Iterable[float], digits: int = 0, times: float = 1) -> str:
    """Return the least and the largest of some numbers in words."""
    least, *_, largest = sorted(numbers)
    return joined((least, largest), digits, " to ", times)


def shapes_mm(results: Results, **settings: object) -> list[float]:
    """Return the errors of drawn shapes in mm rms, by digit."""
    return [
        1000 * value
        for digit in (2, 5, 8)
        for value in values(results, "metrics.shape_error_rms_m", digit=digit, **settings)
    ]


def dynamic_uj(results: Results, calibration: str) -> list[float]:
    """Return the dynamic energy of a step in uJ."""
    place = f"energy.{calibration}.dynamic.energy_step.value"
    return [1e6 * joules for joules in values(results, place)]


# the arm


def _reaches(box: str, results: Iterable[Results]) -> str:
    cells = (joined(values(runs, "metrics.reaches")) for runs in results)
    return f"| {box} | {' | '.join(cells)} |"


@states("docs/figures.md")
def reaches_in_the_small_box(
    reach_small_analytic: Results, reach_small_reference: Results, reach_small_native: Results
) -> Iterator[str]:
    yield _reaches("small", (reach_small_analytic, reach_small_reference, reach_small_native))


@states("docs/figures.md")
def reaches_in_the_large_box(
    reach_large_analytic: Results, reach_large_reference: Results, reach_large_native: Results
) -> Iterator[str]:
    yield _reaches("large", (reach_large_analytic, reach_large_reference, reach_large_native))


@states("docs/arm.md")
def fastest_drawing(
    draw_4s: Results, draw_6s: Results, draw_8s: Results, draw_12s: Results, draw_20s: Results
) -> Iterator[str]:
    drawings = (draw_4s, draw_6s, draw_8s, draw_12s, draw_20s)
    for seconds, drawn in zip(SECONDS, drawings, strict=True):
        shape = joined(shapes_mm(drawn)[1:], 1, ", ")
        lags = (values(drawn, "metrics.tracking_error_rms_m", digit=digit)[0] for digit in (5, 8))
        yield f"| {seconds} | {shape} | {joined(lags, 1, ', ', 1000)} |"


@states("docs/arm.md")
def the_exact_laws_shapes(draw_12s: Results) -> Iterator[str]:
    yield f"| exact law, no neurons | {joined(shapes_mm(draw_12s), 1, ', ')} | | | |"


@states("docs/arm.md")
def shapes_of_three_networks(draw_lean: Results) -> Iterator[str]:
    cells = (joined(shapes_mm(draw_lean, network_seed=seed), 1, ", ") for seed in range(3))
    cores = _cores(draw_lean)
    yield f"| **S1's intercepts even, as it is** | {' | '.join(cells)} | {cores} |"


@states("docs/arm.md")
def shapes_with_an_efference_copy(draw_efference: Results) -> Iterator[str]:
    cores = _cores(draw_efference)
    shapes = joined(shapes_mm(draw_efference), 1, ", ")
    yield f"| the same as it is, with an efference copy | {shapes} | | | {cores} |"


@states("docs/arm.md")
def sizes_of_the_arm(draw_sizes: Results, reach_sizes: Results) -> Iterator[str]:
    for m1 in SIZES:
        both = [*_sized(draw_sizes, m1), *_sized(reach_sizes, m1)]
        longest = max(values(both, "timing.nahuku-fit.worst.value"))
        yield (
            f"| {m1:,} | {3 * m1 + 1550:,} | {max(values(both, 'resources.cores.used'))} "
            f"| {max(dynamic_uj(both, 'nahuku-fit')):.2f} | {1e6 * longest:.0f} "
            f"| {joined(shapes_mm(draw_sizes, m1=m1), 1, ', ')} "
            f"| {joined(values(reach_sizes, 'metrics.reaches', m1=m1), 0, ', ')} |"
        )


def _sized(results: Results, m1: int) -> Results:
    return [one for one in results if one["settings"]["m1"] == m1]


@states("docs/figures.md")
def cores_of_the_lean_arm(arm_lean: Results) -> Iterator[str]:
    yield f"| the arm, lean: 4,550 neurons | 26 | {_cores(arm_lean)} ({_bound(arm_lean)}) |"


@states("docs/figures.md")
def cores_of_the_papers_arm(arm_paper: Results) -> Iterator[str]:
    cores, bound = _cores(arm_paper), _bound(arm_paper)
    yield f"| the arm, the paper's 25,550 neurons | 53 | {cores} ({bound}) |"


@states("README.md")
def cores_of_both_arms(arm_lean: Results, arm_paper: Results) -> Iterator[str]:
    yield f"(4,550 neurons, alone on {_cores(arm_lean)} cores)"
    yield f"the paper's 25,550 neurons ({_cores(arm_paper)} cores)"


def _cores(results: Results) -> int:
    return int(_only({_part(one, "resources.cores.used") for one in results}, "cores"))


def _bound(results: Results) -> int:
    """Return the number of cores that no packing can go below."""
    return int(_part(_only(results, "compiles"), "resources.cores.lower_bound"))


# the whole humanoid


@states("docs/switch.md")
def the_switch(switch: Results) -> Iterator[str]:
    shapes = values(switch, "metrics.shape_error_rms_m")
    _no_falls(switch)
    phases = values(switch, "metrics.phases")
    longest = (max(one["switching_time_s"] for one in run) for run in phases)
    yield f"| shape error (mm rms) | {joined(shapes, 1, ' | ', 1000)} |"
    yield f"| longest switch (ms) | {joined(longest, 0, ' | ', 1000)} |"
    yield _path_errors(phases)


@states("docs/switch.md")
def the_switch_on_its_own_feet(switch_free: Results) -> Iterator[str]:
    _no_falls(switch_free)
    phases = values(switch_free, "metrics.phases")
    drawn = [[one for one in run if "shape_error_rms_m" in one] for run in phases]
    shapes = (joined((one["shape_error_rms_m"] for one in run), 1, ", ", 1000) for run in drawn)
    ways = (joined((one["pelvis_moved_m"] for one in run[1:]), 1, ", ", 100) for run in drawn)
    yield f"| shape error of the three drawings (mm rms) | {' | '.join(shapes)} |"
    yield f"| way of the pelvis, second drawing and third (cm) | {' | '.join(ways)} |"
    yield _path_errors(phases)


def _path_errors(phases: Sequence[Sequence[Mapping[str, Any]]]) -> str:
    walks = [[one for one in run if "path_error_rms_m" in one] for run in phases]
    paths = (joined((one["path_error_rms_m"] for one in run), 1, ", ", 100) for run in walks)
    return f"| path error, first walk and second (cm rms) | {' | '.join(paths)} |"


@states("docs/experiments.md")
def the_demo(demo: Results) -> Iterator[str]:
    run = _only(demo, "runs")
    metrics, cores = run["metrics"], _part(run, "resources.cores.used")
    yield f"Intel Loihi: {cores} cores"
    yield f"dynamic energy / step {dynamic_uj(demo, 'davies2018')[0]:.3g} uJ [no interval]"
    yield f"{dynamic_uj(demo, 'nahuku-fit')[0]:.3g} uJ ["
    # Phases have shape errors of their own: this is the run's, among its other figures.
    yield (
        f"phases_done {metrics['phases_done']} recognised_as {metrics['recognised_as']} "
        f"shape_error_rms_m {metrics['shape_error_rms_m']:.4g} spikes_by_nucleus"
    )
    yield f"spikes_per_second {metrics['spikes_per_second']:.4g}"


@states("README.md")
def the_demo_in_short(demo: Results, switch: Results) -> Iterator[str]:
    run = _only(demo, "runs")
    yield f"are one image on {_part(run, 'resources.cores.used')} cores of one emulated Loihi"
    shapes = values(switch, "metrics.shape_error_rms_m")
    # A processor whose last bits differ gives other spikes, as another network seed does.
    yield (
        f"{sum(values(switch, 'metrics.falls'))} falls with {len(shapes)} network seeds, "
        f"the drawn 8 within {math.ceil(1000 * max(shapes))} mm"
    )


def _switched(results: Results) -> str:
    metrics = _only(results, "runs")["metrics"]
    longest = max(one["switching_time_s"] for one in metrics["phases"])
    return (
        f"{metrics['phases_done']} phases done, the drawing "
        f"{1000 * metrics['shape_error_rms_m']:.1f} mm off, switches within {1000 * longest:.0f} ms"
    )


@states("docs/paper.md")
def the_switch_by_nengo_spa(switch_spa: Results) -> Iterator[str]:
    yield _switched(switch_spa)


@states("docs/switch.md")
def the_switch_with_the_papers_arm(switch_paper: Results) -> Iterator[str]:
    yield f"the image is on {_cores(switch_paper)} cores"
    yield _switched(switch_paper)
    davies, nahuku = (dynamic_uj(switch_paper, name)[0] for name in ("davies2018", "nahuku-fit"))
    yield f"A step takes {davies:.1f} uJ ({nahuku:.1f} uJ by `nahuku-fit`)"


# walking


def _off_mm(results: Results, path: str) -> list[float]:
    return [1000 * m for m in values(results, "metrics.cross_track_rms_m", path=path)]


def _beside(spiking: list[float], exact: list[float]) -> str:
    worst, mean = max(spiking) / max(exact), sum(spiking) / sum(exact)
    return f"{worst:.2f}x, {mean:.2f}x"


def _largest_mm(results: Results, path: str) -> str:
    return joined([max(values(results, "metrics.cross_track_max_m", path=path))], times=1000)


@states("docs/walk.md")
def walks_of_few_neurons(walk_front: Results) -> Iterator[str]:
    _no_falls(walk_front)
    for n_neurons in (2, 4, 6, 10, 20):
        chosen = [one for one in walk_front if one["settings"]["n_neurons"] == n_neurons]
        energies = (fmean(dynamic_uj(chosen, name)) for name in ("davies2018", "nahuku-fit"))
        yield (
            f"| {n_neurons} | {_cores(chosen)} | {' | '.join(f'{e:.1f} uJ' for e in energies)} "
            f"| {joined(_off_mm(chosen, 's-curve'), 1)} | {_largest_mm(chosen, 's-curve')} |"
        )


@states("docs/walk.md")
def walks_of_twenty_neurons(walk_exact: Results, walk_20: Results) -> Iterator[str]:
    _no_falls(walk_20)
    for path in SHAPES:
        exact, spiking = _off_mm(walk_exact, path), _off_mm(walk_20, path)
        yield (
            f"| {path} | {joined(exact, 1)} | {joined(spiking, 1)} | {_largest_mm(walk_20, path)} "
            f"| {_beside(spiking, exact)} |"
        )


@states("docs/walk.md")
def walks_of_ten_neurons(walk_exact: Results, walk_10: Results) -> Iterator[str]:
    _no_falls(walk_10)
    for path in SHAPES:
        exact, spiking = _off_mm(walk_exact, path), _off_mm(walk_10, path)
        largest = _largest_mm(walk_10, path)
        yield f"| {path} | {joined(spiking, 1)} | {largest} | {_beside(spiking, exact)} |"


def _tight(results: Results) -> str:
    errors = (joined(_off_mm(results, path), 1) for path in ("s-curve", "loop"))
    return f"| {' | '.join(errors)} | {_cores(results)} |"


@states("docs/walk.md")
def walks_of_two_neurons(walk_20: Results, walk_2: Results) -> Iterator[str]:
    yield f"| 20 neurons, 2 ms {_tight(walk_20)}"
    yield f"| 2 neurons, 2 ms {_tight(walk_2)}"


@states("docs/walk.md")
def walks_behind_slow_filters(walk_slow: Results) -> Iterator[str]:
    yield f"| 20 neurons, 10 ms {_tight(walk_slow)}"


GAIT = ("speed_use", "clearance_m", "double_support", "steps_per_s", "impact_bw")
"""Measures of an evaluation whose means both tables have."""


@states("docs/walk.md")
def perturbed_walks(perturbed_exact: Results) -> Iterator[str]:
    for row in _rows(perturbed_exact):
        cells = _named(row), _fallen(row, by=" | "), *_errors(row)
        yield f"| {' | '.join(cells)} | {_means(row, *GAIT, 'cost_of_transport')} |"


@states("docs/walk.md")
def perturbed_walks_of_the_robust_policy(
    robust_exact: Results, robust_chip: Results
) -> Iterator[str]:
    for exact, chip in zip(_rows(robust_exact), _rows(robust_chip), strict=True):
        fallen = (_fallen(row, by=", ") for row in (exact, chip))
        cells = _named(exact), *fallen, *_errors(exact)
        yield f"| {' | '.join(cells)} | {_means(exact, *GAIT)} |"
    nominal = _rows(robust_chip)[0]
    speed, yaw_rate, steps, clearance_m = (
        nominal[name]["estimate"]
        for name in ("speed_error_m_s", "yaw_rate_error_rad_s", "steps_per_s", "clearance_m")
    )
    yield (
        f"errors are {speed:.3f} m/s and {yaw_rate:.3f} rad/s undisturbed, and it takes "
        f"{steps:.1f} steps a second with feet {100 * clearance_m:.1f} cm high."
    )


@states("docs/walk.md")
def perturbed_walks_of_few_neurons(perturbed_4: Results, perturbed_20: Results) -> Iterator[str]:
    for few, many in zip(_rows(perturbed_4), _rows(perturbed_20), strict=True):
        falls = (f"{row['falls']} of {row['fell']['n']}" for row in (few, many))
        errors = (cell for pair in zip(_errors(few), _errors(many), strict=True) for cell in pair)
        yield f"| {' | '.join((_named(few), *falls, *errors))} |"


@states("docs/walk.md")
def paths_of_the_robust_policy(robust_paths_exact: Results, robust_paths: Results) -> Iterator[str]:
    for path in SHAPES:
        exact, spiking = _off_mm(robust_paths_exact, path), _off_mm(robust_paths, path)
        yield f"| {path} | {joined(exact, 1)} | {joined(spiking, 1)} |"


def _rows(evaluations: Results) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = _only(evaluations, "evaluations")["rows"]
    return rows


def _named(row: dict[str, Any]) -> str:
    return str(row["row"]) if row["row"] == "nominal" else f"`{row['row']}`"


def _fallen(row: dict[str, Any], by: str) -> str:
    low, high = (100 * row["fell"][end] for end in ("low", "high"))
    return f"{row['falls']} of {row['fell']['n']}{by}{low:.0f}-{high:.0f} %"


def _errors(row: dict[str, Any]) -> list[str]:
    """Return the errors of speed and yaw rate with their intervals, which are symmetric."""
    errors = (row[name] for name in ("speed_error_m_s", "yaw_rate_error_rad_s"))
    return [f"{e['estimate']:.3f} ± {e['high'] - e['estimate']:.3f}" for e in errors]


def _means(row: dict[str, Any], *names: str) -> str:
    return joined((row[name]["estimate"] for name in names), 3, " | ")


@states("docs/robot.md")
def a_walk_with_chip_robot_and_network_in_processes_of_their_own(robot: Results) -> Iterator[str]:
    walk = _only(robot, "runs")
    metrics, seconds = walk["metrics"], walk["seconds"]
    _no_falls(robot)
    yield (
        f"with {1000 * metrics['cross_track_rms_m']:.1f} mm of cross-track error (rms), and has "
        f"{seconds * metrics['spikes_per_second']:,.0f} spikes"
    )


@states("docs/walk.md")
def walks_of_the_figure(fig5a: Results) -> Iterator[str]:
    _no_falls(fig5a)
    exact_cm, spiking_cm = (
        100 * median(values(fig5a, "metrics.cross_track_rms_m", policy=policy))
        for policy in ("mlp", "spiking")
    )
    if f"{exact_cm:.1f}" != f"{spiking_cm:.1f}":
        raise ValueError(f"medians differ: {exact_cm:.1f} cm of exact walks, {spiking_cm:.1f} cm")
    yield f"The median error of both is {exact_cm:.1f} cm (rms), and no robot fell."


@states("docs/walk.md")
def walks_without_half_of_the_ensembles(walk_silenced: Results) -> Iterator[str]:
    fallen_at_s = _only(values(walk_silenced, "metrics.fallen_at_s"), "runs")
    yield f"{fallen_at_s - 25:.1f} s later the robot has fallen"


@states("docs/paper.md")
def walks_without_hidden_noise(
    quiet_exact: Results, quiet_off: Results, quiet_on: Results
) -> Iterator[str]:
    exact = _only(quiet_exact, "runs")
    yield f"Without neurons it is {_walked(exact)}."
    rows = {
        "float, calibration off": [one for one in quiet_off if one["backend"] == "reference"],
        "chip, calibration off": [one for one in quiet_off if one["backend"] == "native"],
        "chip, calibration on": quiet_on,
    }
    for title, results in rows.items():
        both = sorted(results, key=lambda one: one["settings"]["n_neurons"])
        yield f"| {title} | {' | '.join(map(_walked, both))} |"


def _walked(result: dict[str, Any]) -> str:
    """Return how far off its path a robot walked, in words; ValueError if it fell."""
    _no_falls([result])
    return f"{1000 * result['metrics']['cross_track_rms_m']:.1f} mm off"


@states("docs/paper.md")
def walks_in_float_not_calibrated(walk_float: Results) -> Iterator[str]:
    cells = (_float_cell(walk_float, n_neurons) for n_neurons in (2, 20))
    yield f"| float, calibration off (5 seeds, 20 s) | {' | '.join(cells)} |"


def _float_cell(results: Results, n_neurons: int) -> str:
    falls = values(results, "metrics.falls", n_neurons=n_neurons)
    errors = values(results, "metrics.cross_track_rms_m", n_neurons=n_neurons)
    return f"{sum(falls)} of {len(falls)} fell, {span(errors, times=1000)} mm"
