"""Compiled steps of the gears in motion; checks are made by the callers."""
