"""Motions that need not repeat: sections and Lyapunov exponents."""
