"""What the modules of the package share; nothing here is for others."""
