"""Neurons that start at rest."""

import nengo


def at_rest() -> dict[str, nengo.dists.Distribution]:
    """Return the ``initial_state`` of neurons that start at zero, as all neurons on the chip do.

    By default Nengo draws random voltages, and a float run would not begin like one on the chip.
    """
    return {"voltage": nengo.dists.Choice([0])}
