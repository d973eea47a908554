"""Closed-form oracles and the checks of every model against them."""
