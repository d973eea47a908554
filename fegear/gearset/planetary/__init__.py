"""Planetary sets: their gears and meshes from the tables of a file, and the carrier."""
