"""Packing onto the fewest cores, by constraint programming (OR-tools' CP-SAT).

    minimise sum_k y_k   with, for blocks b, cores k, amounts a and profiles p of kind i,
    sum_k x_bk = 1,   x_bk <= y_k,   y_k >= y_k+1
    sum_b a_b x_bk <= room_a,   x_bk <= z_pk for p of b,   sum_p z_pk <= room_i

The search runs in one thread and ends after a number of operations, not seconds, so that its result
is the same on every machine.
"""

import itertools
from types import ModuleType
from typing import TYPE_CHECKING, NamedTuple

from spikeport.compile.placing.lower_bound import lower_bound
from spikeport.compile.placing.problem import Bins, Problem
from spikeport.extras import missing

if TYPE_CHECKING:
    from ortools.sat.python.cp_model import CpModel, IntVar

SEARCH = 30.0
"""The limit of CP-SAT's deterministic time, whose units are of the order of a second."""


class ExactPacking(NamedTuple):
    """The best packing that was found, and a lower bound of the number of cores."""

    bins: Bins
    at_least: int


def pack_exactly(problem: Problem, known: Bins) -> ExactPacking:
    """Pack blocks on as few cores as possible, starting from a packing that is known.

    Parameters
    ----------
    problem : Problem
        The blocks.
    known : Bins
        A packing of them, such as the result of `spikeport.compile.placing.packing.pack`; it is
        returned if it meets the lower bound, if a block fits no core, or if the search finds no
        packing.

    Raises
    ------
    MissingExtraError
        OR-tools is not installed.
    """
    at_least = lower_bound(problem.loads, problem.room)["cores"]
    fits = all(problem.fits([block]) for block in range(len(problem.loads)))
    if len(known) == at_least or not fits:  # verification refuses a block that fits no core
        return ExactPacking(known, at_least)
    cp_model = _ortools()
    model = cp_model.CpModel()
    on = _placements(model, problem, known, at_least)
    _limit_amounts(model, problem, on)
    _limit_profiles(model, problem, on)
    solver = cp_model.CpSolver()
    # More workers, or a limit in seconds, would make results differ from run to run.
    solver.parameters.num_workers = 1
    solver.parameters.max_deterministic_time = SEARCH
    status = solver.solve(model)
    at_least = round(solver.best_objective_bound)
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        return ExactPacking(known, at_least)
    cores = range(len(known))
    bins = [[b for b, where in enumerate(on) if solver.boolean_value(where[k])] for k in cores]
    return ExactPacking([blocks for blocks in bins if blocks], at_least)


def _ortools() -> ModuleType:
    try:
        from ortools.sat.python import cp_model
    except ImportError as error:
        raise missing("pack{exact=true}", "ortools", "optimal") from error
    module: ModuleType = cp_model
    return module


def _placements(
    model: "CpModel", problem: Problem, known: Bins, at_least: int
) -> list[list["IntVar"]]:
    """Return x_bk, after adding the objective and the constraints that do not depend on loads."""
    used = [model.new_bool_var(f"y{k}") for k in range(len(known))]
    on = [
        [model.new_bool_var(f"x{b},{k}") for k in range(len(known))]
        for b in range(len(problem.loads))
    ]
    for where in on:
        model.add_exactly_one(where)
        for here, core in zip(where, used, strict=True):
            model.add_implication(here, core)
    # With a known packing as a hint, the search finds better packings sooner.
    for k, blocks in enumerate(known):
        for block in blocks:
            model.add_hint(on[block][k], 1)
    # Cores are equal: using them in order spares the search their permutations.
    for core, following in itertools.pairwise(used):
        model.add_implication(following, core)
    model.add(sum(used) >= at_least)
    model.minimize(sum(used))
    return on


def _limit_amounts(model: "CpModel", problem: Problem, on: list[list["IntVar"]]) -> None:
    """Limit the sum of each amount on each core."""
    for kind, room in enumerate(problem.room.amounts):
        if room < float("inf"):
            for k in range(len(on[0])):
                total = sum(load.amounts[kind] * on[b][k] for b, load in enumerate(problem.loads))
                model.add(total <= int(room))


def _limit_profiles(model: "CpModel", problem: Problem, on: list[list["IntVar"]]) -> None:
    """Limit the number of distinct profiles of each kind on each core."""
    for kind, room in enumerate(problem.room.profiles):
        masks = [load.profiles[kind] for load in problem.loads]
        bits = range(max(mask.bit_length() for mask in masks))
        if len(bits) <= room:
            continue
        for k in range(len(on[0])):
            held = [model.new_bool_var(f"z{kind},{k},{bit}") for bit in bits]
            model.add(sum(held) <= int(room))
            for b, mask in enumerate(masks):
                for bit in bits:
                    if mask >> bit & 1:
                        model.add_implication(on[b][k], held[bit])
