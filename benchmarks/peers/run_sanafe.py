"""A network on SANA-FE's model of Loihi, which also computes the energy and time of each step."""

import tempfile
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

import numpy as np
import sanafe
from traffic import Running, Traffic, contest

CORES, CORES_PER_TILE = 128, 4


def netlist(traffic: Traffic) -> Iterator[str]:
    """Yield the network's lines in SANA-FE's format, with neurons spread evenly over all cores."""
    yield f"g {traffic.n} soma_hw_name=loihi_lif synapse_hw_name=loihi_dense_synapse leak_decay=1"
    for i, (bias, vth) in enumerate(zip(traffic.bias, traffic.vth, strict=True)):
        yield f"n 0.{i} bias={bias} threshold={vth}"
    for source, target, weight in zip(traffic.source, traffic.target, traffic.weight, strict=True):
        yield f"e 0.{source}->0.{target} weight={weight}"
    for i in range(traffic.n):
        tile, core = divmod(i * CORES // traffic.n, CORES_PER_TILE)
        yield f"& 0.{i}@{tile}.{core}"


def build(traffic: Traffic) -> Running:
    """Build the network."""
    arch = sanafe.load_arch(Path(sanafe.__file__).parent / "examples" / "loihi.yaml")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "net"
        path.write_text("\n".join(netlist(traffic)) + "\n", encoding="utf-8")
        net = sanafe.load_net(str(path), arch, use_netlist_format=True)
    chip = sanafe.SpikingChip(arch)
    chip.load(net)
    fired = [0]

    def run(steps: int) -> None:
        fired[0] += chip.sim(steps)["neurons_fired"]

    return Running(run, lambda: np.array(fired))


contest(f"SANA-FE {version('sanafe')}", build)
