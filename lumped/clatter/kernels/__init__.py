"""Impacts, flights and maps of loose wheels, compiled."""
