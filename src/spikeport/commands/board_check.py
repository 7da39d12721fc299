"""``spikeport board check IMAGE``: the registers of a real chip, compared with the image."""

from pathlib import Path

import typer

from spikeport.backends.board.nxsdk.check import Checked, check
from spikeport.backends.board.nxsdk.model import Placement
from spikeport.compile.image.chip_image import ChipImage

COMPARED = {
    "u": "u",
    "v": "v",
    "spiked": "spikes",
    "noise": "settings of noise",
    "learning": "registers of learning",
}


def run(path: Path, *, n_steps: int, seed: int) -> int:
    """Print a check of each placement of an image, and return the exit code."""
    image = ChipImage.load(path)
    single, packed = Placement.single(image), Placement.packed(image)
    typer.echo(
        f"image {image.digest[:12]}: {image.n_compartments:,} compartments in {image.n_blocks} "
        f"blocks, {len(image.synapses):,} synapses, {image.n_inputs:,} sources on the host"
    )
    # An image with one block per core has one placement.
    outcomes = []
    for placement in [single] if packed.is_single else [single, packed]:
        outcomes.append(check(image, placement, n_steps, seed))
        for line in _lines(outcomes[-1]):
            typer.echo(line)
    first_day, *others = outcomes
    failed = not first_day.equal or any(not one.equal and not one.refused for one in others)
    return int(failed)


def _lines(checked: Checked) -> list[str]:
    """Return the lines of one placement: registers written, steps compared, and findings."""
    name = checked.placement.name
    if checked.refused:
        first = f"{name}: not written, nengo-loihi's hardware half refuses it"
        return [first, *_findings(checked)]
    differing = ", ".join(f"{COMPARED[key]} {n:,}" for key, n in checked.differing.items())
    return [
        f"{name}: {checked.n_cores} cores, {checked.n_synapses:,} synapses, "
        f"{checked.n_registers:,} registers written",
        f"  {checked.n_steps:,} steps, {checked.n_spikes:,} spikes; differing: {differing}",
        f"  {checked.n_phantoms:,} phantom spikes in {checked.n_spike_values:,} values that snips "
        "read",
        *_findings(checked),
    ]


def _findings(checked: Checked) -> list[str]:
    return [f"  {found}" for found in checked.findings]
