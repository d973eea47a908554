"""Signals as sensors give them, and their analysis over the turns of a gear."""
