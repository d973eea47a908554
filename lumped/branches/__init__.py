"""Periodic motions of gear trains, stable or not, and how they hang together."""
