"""Event files of cameras, written as the formats say, and networks that they feed."""

from pathlib import Path
from typing import Any

import nengo
import nengo_loihi
import numpy as np
from nengo.dists import Choice

CAMERA = {"dvs_height": 12, "dvs_width": 16}
HEADER = b"#!AER-DAT2.0\r\n# made by hand\r\n"


def random_events(n: int, last_us: int, seed: int = 0) -> dict[str, np.ndarray]:
    """Return events of a small camera, in no order."""
    rng = np.random.default_rng(seed)
    ends = {"t": last_us + 1, "y": 12, "x": 16, "p": 2}
    return {name: rng.integers(0, end, n) for name, end in ends.items()}


def write_events(path: Path, **events: Any) -> Path:
    """Write a file in the format that its suffix names, with t, y, x and p of each event."""
    t, y, x, p = (np.asarray(events[name], dtype=np.int64) for name in "tyxp")
    if path.suffix == ".aedat":
        words = np.stack([y << 22 | x << 12 | p << 11, t], axis=1).astype(">u4")
        path.write_bytes(HEADER + words.tobytes())
    else:
        table = np.zeros(len(t), dtype=[("y", "<u2"), ("x", "<u2"), ("t", "<u4")])
        table["y"], table["x"], table["t"] = y << 2 | p << 1, x << 1, t
        path.write_bytes(table.tobytes())
    return path


def process_of(path: Path, **options: Any) -> nengo_loihi.dvs.DVSFileChipProcess:
    return nengo_loihi.dvs.DVSFileChipProcess(str(path), **{**CAMERA, **options})


def camera_network(process: nengo_loihi.dvs.DVSFileChipProcess) -> nengo.Network:
    """Return a network with an ensemble for each polarity, and one fed a sum over all pixels."""
    with nengo.Network(seed=2) as network:
        u, n = nengo.Node(process, label="camera"), process.height * process.width
        for polarity in range(2):
            pixels = slice(polarity, None, 2)
            if not process.channels_last:
                pixels = slice(polarity * n, (polarity + 1) * n)
            one = nengo.Ensemble(
                n,
                1,
                neuron_type=nengo_loihi.LoihiSpikingRectifiedLinear(),
                gain=Choice([101]),
                bias=Choice([0]),
                label=f"polarity {polarity}",
            )
            nengo.Connection(u[pixels], one.neurons, transform=0.02, synapse=0.002)
            nengo.Probe(one.neurons)
        brightness = nengo.Ensemble(30, 1, label="brightness")
        weights = np.tile([-1, 1], n)[np.newaxis] / n / 10
        nengo.Connection(u, brightness, transform=weights)
        nengo.Probe(brightness, synapse=0.01)
    return network
