"""Studies: a file each, which declares it, computes it, and shows what it found."""
