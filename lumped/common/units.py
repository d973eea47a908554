"""Units of keys, columns and figures, that are not those of SI."""

MM, UM = 1e-3, 1e-6  # [m]
TO_MM, TO_UM = 1e3, 1e6  # of a length in metres
