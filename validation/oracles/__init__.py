"""Closed forms written from the books, sharing no code with any solver."""

from validation.oracles import hertz, iso6336, potential_energy, ring

__all__ = ["hertz", "iso6336", "potential_energy", "ring"]
