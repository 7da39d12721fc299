"""An experiment at many settings and seeds, in processes of this machine or on a Dask cluster."""
