"""States of the finite elements of a section."""

from __future__ import annotations

from typing import Literal

SectionPlane = Literal["stress", "strain"]
Plane = Literal[SectionPlane, "width"]
DEFAULT_PLANE: Plane = "width"


def plane_in_words(plane: str) -> str:
    """State of the finite elements in titles."""
    return "teeth of true width" if plane == "width" else f"plane {plane}"


def section_plane(plane: Plane) -> SectionPlane:
    """State of a section: plane strain in teeth of their width."""
    return "stress" if plane == "stress" else "strain"
