# %% [markdown]
# # A memory of symbols
#
# In the semantic pointer architecture a symbol is a vector. A state with feedback holds the one it
# was given after it is gone: a working memory of spiking neurons.

# %%
import matplotlib.pyplot as plt
import nengo
import nengo_spa as spa
import numpy as np

import spikeport

spikeport.set_defaults()
DIMENSIONS, GIVEN_S = 16, 0.25
words = spa.Vocabulary(DIMENSIONS, pointer_gen=np.random.RandomState(1))
words.populate("APPLE; PEAR; PLUM")

with spa.Network(seed=1, label="memory") as model:
    given = nengo.Node(lambda t: (t < GIVEN_S) * words["PEAR"].v, label="given")
    memory = spa.State(words, subdimensions=8, feedback=0.9, feedback_synapse=0.1, label="memory")
    nengo.Connection(given, memory.input, synapse=0.03)
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
axes.axvspan(0, GIVEN_S, color="0.9")
axes.set(title="PEAR is given, and held", xlabel="time (s)", ylabel="similarity")
axes.legend()
plt.show()
