# %% [markdown]
# # A PyTorch policy, converted
#
# A small perceptron is trained in PyTorch to steer: it turns an error and its speed into a force
# that levels off. spikeport reads its TorchScript file, without torch, and converts it to spiking
# neurons: a population for each unit. The example needs the extra `train`, which brings torch.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import torch

import spikeport
from spikeport.experiments.policy.conversion import Conversion
from spikeport.networks.loading.files import load_mlp
from spikeport.networks.perceptron import options_for

torch.manual_seed(0)
observations = torch.rand(400, 2) * 2 - 1
wanted = torch.tanh(2.0 * observations[:, :1] + observations[:, 1:])
net = torch.nn.Sequential(torch.nn.Linear(2, 8), torch.nn.Tanh(), torch.nn.Linear(8, 1))
optimizer = torch.optim.Adam(net.parameters(), lr=0.03)
for _ in range(200):
    optimizer.zero_grad()
    torch.nn.functional.mse_loss(net(observations), wanted).backward()
    optimizer.step()

# %% [markdown]
# ## Spikes
#
# Each unit is represented over the range of values that it takes for these observations.

# %%
with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "policy.pt"
    torch.jit.trace(net, observations).save(str(path))
    mlp = load_mlp(path)
conversion = Conversion(mlp, options_for(mlp, n_neurons=20), observations.numpy())
model = conversion.network(probed=False)

with spikeport.Simulator(model, pipeline="compact") as sim:
    sim.run(1.0)  # 20 observations, each for 50 ms
print(sim.compilation)

# %%
exact = mlp.exact(conversion.sample)[-1]
figure, axes = plt.subplots(layout="constrained")
axes.step(np.arange(len(exact)) * 0.05, exact, where="post", label="PyTorch")
axes.plot(sim.trange(), sim.data[model.action], label="spikes, on the chip")
axes.set(title="A policy, one observation after the other", xlabel="time (s)", ylabel="force")
axes.legend()
plt.show()
