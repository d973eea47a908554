"""Help of the choices that all finite elements share."""

PLANE = "Plane stress or plane strain of the finite elements."
RESOLUTION = "Fineness of the finite-element mesh and of the contact grid."
