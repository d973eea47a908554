"""What all parts share: tables as text, compiled kernels, workers, checks."""
