"""The spiking controllers, as plain Nengo networks with named input and output nodes."""
