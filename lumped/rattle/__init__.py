"""Rattle of lightly loaded gears on eccentric bearings: quiet and noisy motion.

J. Mason, thesis on gear rattle in Roots vacuum pumps (2008); equation numbers are its.
"""
