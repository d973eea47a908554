"""Files as they are written and kept: whole, locked, with errors in one line."""
