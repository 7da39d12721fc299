# %% [markdown]
# # An oscillator
#
# A population that is connected to itself turns its state at a constant speed:
#
#     dx/dt = A x,    A = [[0, -omega], [omega, 0]]
#
# Through a low-pass filter of time constant tau the recurrent connection needs the matrix
# tau A + I. A short kick at the beginning starts it; from then on the chip computes alone.

# %%
import matplotlib.pyplot as plt
import nengo
import numpy as np

import spikeport

spikeport.set_defaults()
TAU_S, OMEGA = 0.1, 2 * np.pi * 2  # two turns a second

with nengo.Network(seed=3, label="oscillator") as model:
    kick = nengo.Node(lambda t: [8, 0] if t < 0.1 else [0, 0], label="kick")
    state = nengo.Ensemble(300, dimensions=2, label="state")
    turn = np.array([[1, -OMEGA * TAU_S], [OMEGA * TAU_S, 1]])
    nengo.Connection(kick, state, transform=TAU_S, synapse=TAU_S)
    nengo.Connection(state, state, transform=1.05 * turn, synapse=TAU_S)
    orbit = nengo.Probe(state, synapse=0.03, label="orbit")

# %%
with spikeport.Simulator(model) as sim:
    sim.run(2.0)
print(sim.activity)

# %%
figure, (over_time, plane) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
over_time.plot(sim.trange(), sim.data[orbit])
over_time.set(title="Both dimensions", xlabel="time (s)")
plane.plot(*sim.data[orbit].T)
plane.set(title="The orbit", aspect="equal")
plt.show()
