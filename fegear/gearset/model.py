"""What a gear set is once read and checked: frozen values in SI units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from meshes import GearPair, SpurGear


@dataclass(frozen=True, kw_only=True)
class Gear:
    """A spur gear with its width, material and, optionally, inertia.

    pitch_errors : material missing on each tooth's flank [m], or empty; positive
        opens a gap
    """

    name: str
    geometry: SpurGear
    face_width: float
    young_modulus: float
    poisson_ratio: float
    density: float
    inertia: float | None = None
    mass: float | None = None
    pitch_errors: tuple[float, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Relief:
    """Profile modification of one flank, growing from its start to the end.

    Tip relief ends at the tip, root relief at the lowest point of contact.

    magnitude : material removed at the end [m]
    start_roll_length : sqrt(r^2 - rb^2) where it begins [m]
    """

    magnitude: float
    start_roll_length: float
    shape: Literal["linear", "parabolic"] = "linear"


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Two gears in mesh; indices into the gear set's gears.

    torques : on the driver, the set's load cases [N m]
    phase : position of this mesh's cycle relative to the first mesh's, in base
        pitches, or None to leave it open
    """

    driver: int
    driven: int
    pair: GearPair
    driver_tip_relief: Relief | None = None
    driver_root_relief: Relief | None = None
    driven_tip_relief: Relief | None = None
    driven_root_relief: Relief | None = None
    torques: tuple[float, ...] = ()
    phase: float | None = None


@dataclass(frozen=True, kw_only=True)
class GearSet:
    """Gears, their meshes and rigid shafts (tuples of gear indices)."""

    name: str
    description: str
    gears: tuple[Gear, ...]
    meshes: tuple[Mesh, ...]
    shafts: tuple[tuple[int, ...], ...] = ()
    inferences: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """The name, and the description if there is one."""
        return f"{self.name}: {self.description}" if self.description else self.name
