"""An experiment at many settings and seeds, over Dask."""
