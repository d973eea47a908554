"""Help of the choices that all finite elements share."""

PLANE = (
    "Plane stress or plane strain of the finite elements, or width: teeth of their "
    "true width. [default: that of the gear set, width unless it names one]"
)
RESOLUTION = "Fineness of the finite-element mesh and of the contact grid."
