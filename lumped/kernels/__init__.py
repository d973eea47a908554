"""Compiled loops: arrays in, motion out; checks are made by the callers."""
