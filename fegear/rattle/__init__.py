"""Gear rattle of machines in files: will it rattle, how likely, what change helps."""
