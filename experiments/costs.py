"""The energy of a run per unit of the robot's work: a reach, a metre, a second."""

from collections.abc import Mapping

from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.energy import Draw, energy

Amounts = Mapping[str, float]
"""The amount of each unit in a run."""


def by_unit(
    activity: Activity, chip: ChipModel, amounts: Amounts, n_steps: int
) -> dict[str, dict[str, dict[str, object]]]:
    """Return the energy of a run in J per unit, for each unit and calibration.

        E = (n_active E_dyn + n_steps E_stat) / amount

    A chip draws static power in all ``n_steps`` of a run, but dynamic energy only in the
    ``n_active`` steps that it made: a late board misses steps, and its host holds the outputs.

    Parameters
    ----------
    activity : Activity
        The counts of the run.
    chip : ChipModel
        The chip.
    amounts : mapping of str to float
        The amount of each unit in the run; a unit with amount 0 is left out.
    n_steps : int
        The steps of the run, including steps that a board missed.

    Returns
    -------
    found : dict
        The estimates ``dynamic`` and ``static`` for each unit and calibration, as plain data; None
        where no figure is public. Neither includes host processors or host I/O.
    """
    spent = {one.name: energy(activity, chip, one) for one in chip.calibrations}
    return {
        unit: {
            name: {
                "dynamic": _share(one.dynamic, one.n_steps / amount),
                "static": _share(one.static, n_steps / amount),
            }
            for name, one in spent.items()
        }
        for unit, amount in amounts.items()
        if amount
    }


def _share(draw: Draw | None, steps: float) -> dict[str, object] | None:
    return None if draw is None else draw.energy_step.scaled(steps).to_dict()
