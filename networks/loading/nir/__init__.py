"""NIR graphs, read within limits, as networks: `spikeport.nir` is the door.

A file becomes plain values (`hdf5`), these a flat graph of nodes (`graph`), in which all linear
operators between two populations of neurons become one sparse matrix (`operators`, `signals`,
`fold`; `checks` refuses some graphs). Left are populations and their inputs (`populations`).
Neurons are coefficients of a time step (`dynamics`). Such a graph runs by NIR's own equations
(`equations`), or is put into units of the chip (`units`) and built as a network (`network`);
`differences` names what the chip then does otherwise.
"""
