"""The report on a compiled network: resources, energy, time, loss and budgets."""
