"""A recording is cut into overlapping pieces, which the processes of a Dask cluster track at the same time."""
