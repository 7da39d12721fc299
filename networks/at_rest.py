"""Neurons that start at rest."""

import nengo


def at_rest() -> dict[str, nengo.dists.Distribution]:
    """Return the ``initial_state`` of neurons that start at zero, as the chip starts all of them.

    Nengo draws voltages otherwise, and float and chip would not begin alike.
    """
    return {"voltage": nengo.dists.Choice([0])}
