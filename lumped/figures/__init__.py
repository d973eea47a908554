"""Plots of results; functions of a result, drawn without a screen."""
