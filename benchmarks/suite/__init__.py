"""nacre against its peers: the workloads, and the harness that runs them side by side."""
