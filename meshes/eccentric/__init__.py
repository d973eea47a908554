"""Circular wheel with an eccentric bearing and the wheel that it drives."""

from meshes.eccentric.pitch import EccentricPair, PitchCurve

__all__ = ["EccentricPair", "PitchCurve"]
