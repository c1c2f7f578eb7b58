"""The workloads, one idea a module; peers are imported where they are used."""
