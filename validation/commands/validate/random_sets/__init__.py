"""The coupled model against finite elements on random gear sets with fixed seeds."""
