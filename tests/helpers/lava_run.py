"""A script for a Python with Lava, which runs compartments on Lava's fixed-point CPU models.

    python lava_run.py WIRING.npz RESULT.npz

It imports nothing of spikeport, which is not installed there. Weights are Lava's own `Sparse`
processes, and Lava's own code updates currents and voltages. With ``stock`` set the neurons are
Lava's `LIF` too; else they are the process below, since `LIF` in fixed point has no refractory
delay, one threshold and one decay for all of its neurons, and no lower limit of the voltage.
"""

import sys

import numpy as np
from lava.magma.core.decorator import implements, requires, tag
from lava.magma.core.model.py.ports import PyInPort, PyOutPort
from lava.magma.core.model.py.type import LavaPyType
from lava.magma.core.process.ports.ports import InPort, OutPort
from lava.magma.core.process.process import AbstractProcess
from lava.magma.core.process.variable import Var
from lava.magma.core.resources import CPU
from lava.magma.core.run_conditions import RunSteps
from lava.magma.core.run_configs import Loihi1SimCfg
from lava.magma.core.sync.protocols.loihi_protocol import LoihiProtocol
from lava.proc.io.source import RingBuffer
from lava.proc.lif.models import AbstractPyLifModelFixed
from lava.proc.lif.process import LIF
from lava.proc.monitor.process import Monitor
from lava.proc.sparse.process import Sparse
from lava.utils.weightutils import SignMode
from scipy import sparse

SETTINGS = ("decay_u", "decay_v", "bias", "threshold", "lowest", "highest", "delay")
STATE = ("u", "v", "spiked")


class Compartments(AbstractProcess):
    """Compartments with settings of their own; ``spiked`` holds the spikes of the last step."""

    def __init__(self, settings):
        super().__init__()
        shape = (len(settings["bias"]),)
        self.a_in, self.s_out = InPort(shape=shape), OutPort(shape=shape)
        for name in ("u", "v", "left", "spiked"):
            setattr(self, name, Var(shape=shape, init=0))
        for name in SETTINGS:
            setattr(self, name, Var(shape=shape, init=settings[name]))


@implements(proc=Compartments, protocol=LoihiProtocol)
@requires(CPU)
@tag("fixed_pt")
class CompartmentsModel(AbstractPyLifModelFixed):
    """Lava's arithmetic of currents and voltages; then the voltage's limits, rest and spikes."""

    a_in: PyInPort = LavaPyType(PyInPort.VEC_DENSE, np.int32, precision=24)
    s_out: PyOutPort = LavaPyType(PyOutPort.VEC_DENSE, np.int32, precision=1)
    left: np.ndarray = LavaPyType(np.ndarray, np.int32)
    spiked: np.ndarray = LavaPyType(np.ndarray, np.int32)
    decay_u: np.ndarray = LavaPyType(np.ndarray, np.int32)
    decay_v: np.ndarray = LavaPyType(np.ndarray, np.int32)
    bias: np.ndarray = LavaPyType(np.ndarray, np.int32)
    threshold: np.ndarray = LavaPyType(np.ndarray, np.int32)
    lowest: np.ndarray = LavaPyType(np.ndarray, np.int32)
    highest: np.ndarray = LavaPyType(np.ndarray, np.int32)
    delay: np.ndarray = LavaPyType(np.ndarray, np.int32)
    du = dv = bias_mant = bias_exp = None

    def run_spk(self):
        self.du, self.dv, self.effective_bias = self.decay_u, self.decay_v, self.bias
        self.subthr_dynamics(self.a_in.recv())
        self.v[:] = np.where(self.left > 0, 0, np.clip(self.v, self.lowest, self.highest))
        spiked = self.v > self.threshold
        self.v[spiked] = 0
        self.left[:] = np.maximum(np.where(spiked, self.delay, self.left) - 1, 0)
        self.spiked[:] = spiked
        self.s_out.send(spiked)


def stock(settings):
    """Return Lava's own neurons, which all have the same settings except for the bias."""
    (du,), (dv,), (vth,) = (np.unique(settings[n]) for n in ("decay_u", "decay_v", "threshold"))
    exponents = np.maximum(np.ceil(np.log2(np.maximum(abs(settings["bias"]), 1) / 4096)), 0)
    mantissas = settings["bias"] >> exponents.astype(int)
    assert np.array_equal(mantissas << exponents.astype(int), settings["bias"])
    return LIF(
        shape=settings["bias"].shape,
        du=int(du),
        dv=int(dv),
        vth=int(vth) >> 6,
        bias_mant=mantissas,
        bias_exp=exponents.astype(int),
    )


def connect(source, target, number, file):
    """Connect a source of spikes to compartments, by weights of one exponent."""
    matrix = sparse.csr_matrix(
        (file[f"weight_{number}"], (file[f"target_{number}"], file[f"source_{number}"])),
        shape=(target.a_in.shape[0], source.s_out.shape[0]),
    )
    exponent = int(file[f"exponent_{number}"])
    weights = Sparse(weights=matrix, weight_exp=exponent, sign_mode=SignMode.MIXED)
    source.s_out.connect(weights.s_in)
    weights.a_out.connect(target.a_in)


def monitored(monitor):
    """Return the values of the one variable that a monitor probes, (n_steps, n)."""
    (of_process,) = monitor.get_data().values()
    (values,) = of_process.values()
    return values.astype(np.int64)


def main(wiring, result):
    """Run all steps, and write currents, voltages and spikes after each."""
    file = np.load(wiring)
    settings = {name: file[name].astype(np.int32) for name in SETTINGS}
    as_stock = bool(file["stock"])
    neurons = stock(settings) if as_stock else Compartments(settings)
    host = RingBuffer(data=file["host"].T)
    n_steps = len(file["host"])
    for number in range(int(file["n_matrices"])):
        connect(host if file[f"from_host_{number}"] else neurons, neurons, number, file)
    monitors = {name: Monitor() for name in STATE}
    for name, monitor in monitors.items():
        of_stock = as_stock and name == "spiked"
        monitor.probe(neurons.s_out if of_stock else getattr(neurons, name), n_steps)
    neurons.run(condition=RunSteps(n_steps), run_cfg=Loihi1SimCfg(select_tag="fixed_pt"))
    read = {name: monitored(monitor) for name, monitor in monitors.items()}
    neurons.stop()
    np.savez(result, **read)


if __name__ == "__main__":
    main(*sys.argv[1:])
