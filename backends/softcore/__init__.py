"""The soft core: its memories, written from an image, and the core itself in Verilator."""
