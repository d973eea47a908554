"""Potential energy beside finite elements: healthy pairs and teeth with a root crack."""
