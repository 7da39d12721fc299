# %% [markdown]
# # Basal ganglia
#
# Three actions compete, each with a utility. The basal ganglia stop inhibiting the action with the
# largest utility, and the thalamus lets it through: spiking neurons choose.

# %%
import matplotlib.pyplot as plt
import nengo
import numpy as np

import spikeport

spikeport.set_defaults()
UTILITIES = np.array([[0.9, 0.4, 0.3], [0.3, 0.9, 0.4], [0.4, 0.3, 0.9]])
HOLD_S = 0.3

with nengo.Network(seed=0, label="choice") as model:
    utility = nengo.Node(lambda t: UTILITIES[int(t / HOLD_S) % 3], label="utility")
    ganglia = nengo.networks.BasalGanglia(3)
    thalamus = nengo.networks.Thalamus(3)
    nengo.Connection(utility, ganglia.input)
    nengo.Connection(ganglia.output, thalamus.input)
    utilities = nengo.Probe(utility, label="utilities")
    chosen = nengo.Probe(thalamus.output, synapse=0.02, label="chosen")

# %% [markdown]
# nengo-loihi gives every ensemble a core of its own; when packed, the blocks share a few cores.

# %%
compilation = spikeport.compile_network(model)
print(compilation)

# %%
with spikeport.Simulator(model) as sim:
    sim.run(3 * HOLD_S)

figure, (above, below) = plt.subplots(2, 1, sharex=True, layout="constrained")
above.plot(sim.trange(), sim.data[utilities], label=["A", "B", "C"])
above.set(title="Utilities", ylabel="utility")
above.legend(loc="right")
below.plot(sim.trange(), sim.data[chosen])
below.set(title="Chosen on the chip", xlabel="time (s)", ylabel="thalamus")
plt.show()
