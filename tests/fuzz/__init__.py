"""Good files with changed bytes, each of which loads or is refused with spikeport's own error."""
