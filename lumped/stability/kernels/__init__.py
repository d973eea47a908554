"""Compiled state transition of linear systems."""
