"""Stability of trains whose stiffness varies in time, friction of teeth included.

varying = periodic_system(system)           # of a LumpedSystem, with its friction
largest_multiplier(varying, frequencies)    # Floquet's
examined(varying, frequencies).intervals    # traced to their edges
combinations(varying)                       # by perturbation
"""
