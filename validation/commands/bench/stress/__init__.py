"""Attempts to break the models."""
