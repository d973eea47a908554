"""Independent solutions that only tests compare with."""
