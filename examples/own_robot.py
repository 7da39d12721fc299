"""A cart-pole, balanced by spiking neurons on an emulated chip: a robot that is not the H1.

    python examples/own_robot.py

It needs the extra `robot`; docs/own-robot.md goes through it step by step.
"""

from pathlib import Path

import mujoco
import nengo
import numpy as np

from spikeport import Simulator
from spikeport.experiments.loop import Loop, Port

MODEL = Path(__file__).with_name("cart_pole.xml")
TILT_RAD = 0.1
"""The pole's tilt when a run begins."""
RADII = np.array([0.4, 0.8, 0.2, 1.0])
"""The ranges of place (m), speed (m/s), tilt (rad) and its speed (rad/s) that neurons represent."""
GAINS = np.array([2.2, 4.2, 30.0, 9.0])
"""The force in N per unit of each: force = GAINS . state, near the linear-quadratic optimum."""
MOST_N = 10.0
"""The motor's largest force. Neurons represent shares of it: larger values are lost on the chip."""


class CartPole:
    """The plant: a model in MuJoCo that advances step by step."""

    def __init__(self) -> None:
        self.model = mujoco.MjModel.from_xml_path(str(MODEL))
        self.data = mujoco.MjData(self.model)

    @property
    def dt_s(self) -> float:
        """Length of a step, in s."""
        return float(self.model.opt.timestep)

    @property
    def time_s(self) -> float:
        """Simulated time since `reset`, in s."""
        return float(self.data.time)

    def reset(self, tilt_rad: float) -> None:
        """Put the cart at rest in the middle of the rail, its pole tilted."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.joint("hinge").qpos = tilt_rad
        mujoco.mj_forward(self.model, self.data)

    def step(self) -> None:
        """Advance by one step."""
        mujoco.mj_step(self.model, self.data)


class BalancePort(Port):
    """The cart's motor and sensors: a share of the largest force in (1,), the state out (4,)."""

    size_in = 1
    size_out = 4

    def __init__(self, plant: CartPole) -> None:
        self.plant = plant
        self.tilts_rad: list[float] = []

    def begin(self) -> None:
        """Forget an earlier run."""
        self.tilts_rad = []

    def observe(self) -> np.ndarray:
        """Return place (m), speed (m/s), tilt (rad) and turning speed (rad/s), (4,)."""
        slide, hinge = (self.plant.data.joint(name) for name in ("slide", "hinge"))
        self.tilts_rad.append(hinge.qpos.item())
        return np.concatenate((slide.qpos, slide.qvel, hinge.qpos, hinge.qvel))

    def drive(self, share: np.ndarray) -> None:
        """Push the cart until the next step; the motor clips at 10 N."""
        self.plant.data.actuator("push").ctrl = MOST_N * share

    @property
    def over(self) -> bool:
        """True once the pole lies level: nothing is left to balance."""
        return bool(abs(self.plant.data.joint("hinge").qpos[0]) > np.pi / 2)


class Balancer(nengo.Network):
    """A controller with input ``state`` (4,) and output ``force`` (1,), a share of the largest."""

    def __init__(self, seed: int = 0) -> None:
        super().__init__(label="balancer", seed=seed)
        with self:
            self.state = nengo.Node(size_in=4, label="state")
            self.force = nengo.Node(size_in=1, label="force")
            # on the chip all voltages begin at zero; asking for that avoids a warning
            at_rest = nengo.LIF(initial_state={"voltage": nengo.dists.Choice([0])})
            neurons = nengo.Ensemble(400, 4, neuron_type=at_rest, label="neurons")
            nengo.Connection(self.state, neurons, transform=np.diag(1 / RADII), synapse=0.005)
            gains = (GAINS * RADII / MOST_N)[np.newaxis]
            nengo.Connection(neurons, self.force, transform=gains, synapse=0.005)


def balance(seconds: float, backend: str = "native", seed: int = 0) -> np.ndarray:
    """Return the pole's tilts (n,) in rad while neurons on the chip push the cart."""
    plant = CartPole()
    port = BalancePort(plant)
    loop = Loop(plant, [port])
    with nengo.Network(seed=seed) as network:
        balancer = Balancer(seed)
        loop.connect([balancer.state], [balancer.force])
    with Simulator(network, backend=backend) as sim:
        plant.reset(TILT_RAD)
        loop.begin()
        while sim.time < seconds and not loop.over:
            sim.step()
    return np.array(port.tilts_rad)


def fall(seconds: float) -> np.ndarray:
    """Return the pole's tilts (n,) in rad while nobody pushes the cart."""
    plant = CartPole()
    port = BalancePort(plant)
    loop = Loop(plant, [port], plant.dt_s)
    plant.reset(TILT_RAD)
    loop.begin()
    while plant.time_s < seconds and not loop.over:
        loop.step(np.zeros(1))
    return np.array(port.tilts_rad)


def main() -> None:
    """Print how far the pole tilts, with the controller and without."""
    for name, tilts_rad in (("neurons push", balance(10.0)), ("nobody pushes", fall(10.0))):
        seconds = CartPole().dt_s * (len(tilts_rad) - 1)
        largest, late = np.degrees((np.abs(tilts_rad).max(), np.abs(tilts_rad[-200:]).max()))
        most = f"tilt at most {largest:.1f}, in the last second {late:.1f} degrees"
        print(f"{name}: {seconds:.1f} s, {most}")


if __name__ == "__main__":
    main()
