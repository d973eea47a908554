"""Branches of solutions over a parameter, and the bifurcations along them."""
