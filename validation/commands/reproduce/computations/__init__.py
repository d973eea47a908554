"""Computations of figures, a function for each kind of part; `kinds` lists them."""
