"""What a run took on the chip, for ``result.json``."""

from typing import Any

from spikeport.simulator import Simulator


def digest_of(sim: Simulator) -> str:
    """Of the image that runs; empty where no chip is involved."""
    return "" if sim.image is None else sim.image.digest


def on_chip(sim: Simulator) -> dict[str, Any]:
    """Image digest, resources, energy and timing; None for each where no chip was involved."""
    if sim.compilation is None:
        return dict.fromkeys(("image_digest", "resources", "energy", "timing"))
    report = sim.report()
    return {key: report[key] for key in ("image_digest", "resources", "energy", "timing")}
