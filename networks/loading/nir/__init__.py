"""NIR graphs, read within limits, as networks; the public interface is `spikeport.nir`.

A file is read into plain values (`hdf5`), and these become a flat graph of nodes (`graph`). The
linear operators between two populations of neurons become one sparse matrix (`operators`,
`signals`, `fold`; `checks` refuses some graphs), so that populations and their inputs are left
(`populations`). Neurons are described by the coefficients of a time step (`dynamics`). The graph
runs by NIR's own equations (`equations`), or is converted to units of the chip (`units`) and built
as a network (`network`); `differences` lists where the chip then departs from the equations.
"""
