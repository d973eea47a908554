"""The finite-element gears in motion."""
