"""Clattering gearboxes: loose wheels that move freely within their plays."""
