"""Faults of teeth: what a file says of them, checked and built."""
