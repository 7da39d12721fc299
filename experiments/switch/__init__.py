"""The humanoid: it walks, draws and walks on, as its basal ganglia choose."""
