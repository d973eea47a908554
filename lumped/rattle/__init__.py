"""Rattle of lightly loaded gears on eccentric bearings: quiet and noisy motion.

The equation numbers are those of J. Mason, thesis on gear rattle in Roots vacuum pumps
(2008).
"""
