"""Clattering gearboxes: files, runs and what they give."""
