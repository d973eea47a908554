"""Stability of trains whose stiffness varies in time, friction of teeth included.

varying = periodic_system(system, [ToothFriction(0.1, 0.39)])   # of a LumpedSystem
largest_multiplier(varying, frequencies)                        # Floquet's
examined(varying, frequencies).intervals                        # traced to their edges
combinations(varying)                                           # by perturbation
"""
