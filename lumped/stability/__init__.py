"""Stability of trains whose stiffness varies in time, including friction of teeth.

varying = periodic_system(system)           # from a LumpedSystem, with its friction
largest_multiplier(varying, frequencies)    # Floquet multipliers
examined(varying, frequencies).intervals    # traced to their edges
combinations(varying)                       # by perturbation
"""
