"""Tracking and models on simulated and real recordings, beside peers."""
