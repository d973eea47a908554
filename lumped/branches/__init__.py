"""Branches of periodic motions of gear trains, and their bifurcations."""
