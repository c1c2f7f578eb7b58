"""Many recordings become models, each in its folder, by the processes of a Dask cluster."""
