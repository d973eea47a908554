"""Compiled motion between the flanks."""
