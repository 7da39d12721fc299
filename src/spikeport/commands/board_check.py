"""``spikeport board check IMAGE``: the registers of a real chip, compared with the image."""

from pathlib import Path

import typer

from spikeport.backends.board.nxsdk.check import Checked, check
from spikeport.backends.board.nxsdk.model import Placement
from spikeport.backends.board.nxsdk.traps import Finding
from spikeport.compile.check.violation import listed
from spikeport.compile.image.chip_image import ChipImage
from spikeport.counted import counted

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
        f"image {image.digest[:12]}: {counted(image.n_compartments, 'compartment')} in "
        f"{counted(image.n_blocks, 'block')}, {counted(len(image.synapses), 'synapse')}, "
        f"{counted(image.n_inputs, 'source')} on the host"
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
        f"{name}: {counted(checked.n_cores, 'core')}, {counted(checked.n_synapses, 'synapse')}, "
        f"{counted(checked.n_registers, 'register')} written",
        f"  {counted(checked.n_steps, 'step')}, {counted(checked.n_spikes, 'spike')}; "
        f"differing: {differing}",
        f"  {counted(checked.n_phantoms, 'phantom spike')} in "
        f"{counted(checked.n_spike_values, 'value')} that snips read",
        *_findings(checked),
    ]


def _findings(checked: Checked) -> list[str]:
    """Return a line for each trap and use, with the first places that it concerns."""
    alike: dict[Finding, list[str]] = {}
    for found in checked.findings:
        alike.setdefault(found._replace(where=""), []).append(found.where)
    return [f"  {found._replace(where=listed(where))}" for found, where in alike.items()]
