"""Clattering gearboxes: loose wheels that fly between the edges of their plays."""
