"""Utilities shared by all parts: tables as text, compiled kernels, workers, checks."""
