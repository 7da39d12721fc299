# %% [markdown]
# # A communication channel
#
# Two populations of spiking neurons pass a value on: the first encodes it, the second decodes the
# spikes of the first. On the chip the second arrives a few milliseconds later, with some noise.

# %%
import matplotlib.pyplot as plt
import nengo

import spikeport

spikeport.set_defaults()  # firing rates and intercepts that suit the chip

with nengo.Network(seed=1, label="communication channel") as model:
    stimulus = nengo.Node(nengo.processes.WhiteSignal(period=1.0, high=4, rms=0.35, seed=2))
    sender = nengo.Ensemble(100, dimensions=1, label="sender")
    receiver = nengo.Ensemble(100, dimensions=1, label="receiver")
    nengo.Connection(stimulus, sender)
    nengo.Connection(sender, receiver)
    sent = nengo.Probe(stimulus, label="sent")
    received = nengo.Probe(receiver, synapse=0.02, label="received")

# %% [markdown]
# ## The fit
#
# A compile reports how much of the chip the network uses.

# %%
compilation = spikeport.compile_network(model)
print(compilation)

# %% [markdown]
# ## The run

# %%
with spikeport.Simulator(model) as sim:
    sim.run(1.0)

figure, axes = plt.subplots(layout="constrained")
axes.plot(sim.trange(), sim.data[sent], label="sent")
axes.plot(sim.trange(), sim.data[received], label="received, on the chip")
axes.set(title="A communication channel", xlabel="time (s)", ylabel="value")
axes.legend()
plt.show()
