# %% [markdown]
# # A pole, balanced
#
# The chip runs in closed loop with a small robot, a cart with a pole on it in MuJoCo: the network
# observes the cart and pushes it. `own_robot.py` holds plant, port and network;
# docs/own-robot.md goes through them. The example needs the extra `robot`, which brings MuJoCo.

# %%
import matplotlib.pyplot as plt
import nengo
import numpy as np
from own_robot import TILT_RAD, BalancePort, Balancer, CartPole, balance, fall

import spikeport
from spikeport.experiments.loop import Loop

plant = CartPole()
loop = Loop(plant, [BalancePort(plant)])
with nengo.Network(seed=0, label="pole") as model:
    balancer = Balancer()
    loop.connect([balancer.state], [balancer.force])
plant.reset(TILT_RAD)
loop.begin()  # for `spikeport simulate pole.py`
print(spikeport.compile_network(model))

# %% [markdown]
# ## With the chip, and without

# %%
SECONDS = 2.0
with_chip, without = balance(SECONDS), fall(SECONDS)

# %%
figure, axes = plt.subplots(layout="constrained")
for label, tilts_rad in (("neurons push", with_chip), ("nobody pushes", without)):
    times_s = plant.dt_s * np.arange(len(tilts_rad))
    axes.plot(times_s, np.degrees(tilts_rad), label=label)
axes.set(title="The pole's tilt", xlabel="time (s)", ylabel="tilt (degrees)", ylim=(-15, 95))
axes.legend()
plt.show()
