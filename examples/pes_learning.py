# %% [markdown]
# # Learning on the chip
#
# The PES rule changes decoders so that an error becomes small. The weights begin at zero, and learn
# to pass the stimulus on. After some time the error is switched off, and they stay as they are.

# %%
import matplotlib.pyplot as plt
import nengo
import numpy as np

import spikeport

spikeport.set_defaults()
LEARNS_S = 0.7

with nengo.Network(seed=2, label="learning") as model:
    stimulus = nengo.Node(lambda t: np.sin(4 * np.pi * t), label="stimulus")
    neurons = nengo.Ensemble(50, dimensions=1, label="neurons")
    answer = nengo.Node(size_in=1, label="answer")
    error = nengo.Node(lambda t, x: x * (t < LEARNS_S), size_in=1, label="error")
    nengo.Connection(stimulus, neurons)
    rule = nengo.PES(learning_rate=2e-3)
    learned = nengo.Connection(
        neurons, answer, function=lambda _: 0, synapse=0.02, learning_rule_type=rule
    )
    nengo.Connection(answer, error)
    nengo.Connection(stimulus, error, transform=-1)
    nengo.Connection(error, learned.learning_rule)
    wanted, answered = nengo.Probe(stimulus, label="wanted"), nengo.Probe(answer, label="answered")

# %%
with spikeport.Simulator(model) as sim:
    sim.run(1.0)
print(f"{sim.activity.totals()['learning_updates']:,} updates of weights")

# %%
figure, axes = plt.subplots(layout="constrained")
axes.plot(sim.trange(), sim.data[wanted], label="wanted")
axes.plot(sim.trange(), sim.data[answered], label="learned on the chip")
axes.axvspan(LEARNS_S, 1.0, color="0.9", label="no error any more")
axes.set(title="Learning to pass a value on", xlabel="time (s)")
axes.legend()
plt.show()
