"""Potential energy beside finite elements: healthy and cracked teeth."""
