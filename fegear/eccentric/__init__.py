"""Eccentric gearing: a circular wheel that turns off its centre, and its mate."""
