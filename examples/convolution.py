# %% [markdown]
# # A convolution
#
# An image of 12 x 12 pixels becomes spikes on the host. On the chip, one filter looks for lying
# (horizontal) edges, one for standing (vertical) edges; nengo-loihi shares weights by population
# axons.

# %%
import matplotlib.pyplot as plt
import nengo
import numpy as np

import spikeport

SIZE, RATE_HZ = 12, 200
image = np.zeros((SIZE, SIZE))
image[3:9, 3:9] = 1.0  # a square
standing = np.array([[-1, 0, 1]] * 3) / 3
kernels = np.stack([standing.T, standing], axis=-1)[:, :, np.newaxis]  # (3, 3, 1, 2)

with nengo.Network(seed=0, label="convolution") as model:
    spikeport.add_params(model)
    at_rest = nengo.SpikingRectifiedLinear(initial_state={"voltage": nengo.dists.Choice([0])})
    options = {"neuron_type": at_rest, "gain": nengo.dists.Choice([1])}
    options["bias"] = nengo.dists.Choice([0])
    picture = nengo.Node(RATE_HZ * image.ravel(), label="picture")
    pixels = nengo.Ensemble(image.size, 1, label="pixels", **options)
    model.config[pixels].on_chip = False
    filters = nengo.Convolution(2, (SIZE, SIZE, 1), kernel_size=(3, 3), init=kernels)
    edges = nengo.Ensemble(filters.output_shape.size, 1, label="edges", **options)
    nengo.Connection(picture, pixels.neurons, synapse=None)
    nengo.Connection(pixels.neurons, edges.neurons, transform=filters, synapse=0.005)
    spikes = nengo.Probe(edges.neurons, label="edges")

# %%
SECONDS = 0.2
with spikeport.Simulator(model) as sim:
    sim.run(SECONDS)
print(sim.compilation)

# %%
rates_hz = (sim.data[spikes] > 0).sum(axis=0) / SECONDS
maps = rates_hz.reshape(filters.output_shape.shape)
figure, panels = plt.subplots(1, 3, figsize=(9, 3.4), layout="constrained")
panels[0].imshow(image, cmap="gray")
panels[0].set_title("The image")
for channel, (axes, name) in enumerate(zip(panels[1:], ("lying", "standing"), strict=True)):
    shown = axes.imshow(maps[..., channel], vmin=0, vmax=RATE_HZ)
    axes.set_title(f"Edges that are {name}")
figure.colorbar(shown, label="rate (Hz)")
plt.show()
