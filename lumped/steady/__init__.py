"""Steady-state motions: the driver, its steppers, sweeps, responses and maps."""
