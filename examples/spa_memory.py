# %% [markdown]
# # A memory of symbols
#
# In the semantic pointer architecture a symbol is a vector. A state with feedback holds its input
# after the input has ended: a working memory of spiking neurons.

# %%
import matplotlib.pyplot as plt
import nengo
import nengo_spa as spa
import numpy as np

import spikeport

spikeport.set_defaults()
DIMENSIONS, INPUT_S = 16, 0.25
words = spa.Vocabulary(DIMENSIONS, pointer_gen=np.random.RandomState(1))
words.populate("APPLE; PEAR; PLUM")

with spa.Network(seed=1, label="memory") as model:
    stimulus = nengo.Node(lambda t: (t < INPUT_S) * words["PEAR"].v, label="stimulus")
    memory = spa.State(words, subdimensions=8, feedback=0.9, feedback_synapse=0.1, label="memory")
    nengo.Connection(stimulus, memory.input, synapse=0.03)
    held = nengo.Probe(memory.output, synapse=0.03, label="held")

# %%
with spikeport.Simulator(model, pipeline="compact") as sim:
    sim.run(0.8)
print(sim.compilation)

# %% [markdown]
# ## The word that is held
#
# The similarity of the memory's state with each word that it might hold.

# %%
similarity = spa.similarity(sim.data[held], words)
figure, axes = plt.subplots(layout="constrained")
axes.plot(sim.trange(), similarity, label=list(words))
axes.axvspan(0, INPUT_S, color="0.9")
axes.set(title="PEAR is put in, and held", xlabel="time (s)", ylabel="similarity")
axes.legend()
plt.show()
