"""Trains, systems and uncompiled kernels shared by the tests."""

from __future__ import annotations

import math
from collections.abc import Callable

import hypothesis
import pytest

from lumped import (
    Gear,
    LumpedSystem,
    Mesh,
    Settings,
    StiffnessParameters,
    Train,
    analytic_excitation,
)

# first calls import and compile, and two cores are shared
hypothesis.settings.register_profile("lumped", deadline=None)
hypothesis.settings.load_profile("lumped")

RADII = (0.04535, 0.06564, 0.11218)  # m, Table 2.1
INERTIAS = (0.002621, 0.01091, 0.1193)  # kg m2
MASSES = (2.2325, 4.438, 16.9419)  # kg
BEARINGS = (1.27e8, 1.4732e8, 1.6637e8)  # N/m
COUPLINGS = (3389.6, 0.0, 11297.9)  # N m/rad
TEETH = (38, 55, 94)
NAMES = ("pinion", "idler", "follower")
ANGLES = (21.22, 21.02)  # deg
FIGURES = ((2.9831e8, 0.35, 1.504), (3.2108e8, 0.4, 1.510))  # k, eps, c


def make_idler(
    *,
    torque: float = 100.0,
    damping: float = 0.04,
    backlash: float = math.inf,
    translations: bool = False,
    coupled: bool = True,
    phases: tuple[float, float] = (0.0, 0.0),
    turned: float = 0.0,
    inertias: tuple[float, ...] = INERTIAS,
) -> Train:
    """The idler of Table 2.1; `turned` rotates all centre lines [rad]."""
    torques = (torque, 0.0, -torque * RADII[2] / RADII[0])
    gears = tuple(
        Gear(
            name=NAMES[i],
            teeth=TEETH[i],
            base_radius=RADII[i],
            inertia=inertias[i],
            mass=MASSES[i],
            bearing_stiffness=(BEARINGS[i],) * 2 if translations else None,
            coupling_stiffness=COUPLINGS[i] if coupled else 0.0,
            torque=torques[i],
        )
        for i in range(3)
    )
    meshes = tuple(
        Mesh(
            driver=i,
            driven=i + 1,
            pressure_angle=math.radians(ANGLES[i]),
            center_line=turned,
            backlash=backlash,
            phase=phases[i],
        )
        for i in range(2)
    )
    return Train(gears=gears, meshes=meshes, damping_ratio=damping)


def make_figures(mesh: int, **changes) -> StiffnessParameters:
    mean, variation, ratio = FIGURES[mesh]
    values = {"mean": mean, "variation": variation, "contact_ratio": ratio}
    return StiffnessParameters(**(values | changes))


def make_relief(mesh: int, magnitude: float) -> list[tuple[float, float]]:
    """Gap of a pair with both tips relieved from the highest single contact."""
    c = FIGURES[mesh][2]
    return [
        (-0.5 * c, magnitude),
        (0.5 * c - 1.0, 0.0),
        (1.0 - 0.5 * c, 0.0),
        (0.5 * c, magnitude),
    ]


def make_system(
    train: Train | None = None,
    *,
    model: int = 1,
    relief: float = 0.0,
    harmonics: int | None = None,
    force: float = 100.0 / RADII[0],
    **figures: float,
) -> LumpedSystem:
    """The idler with waves from its key figures; `figures` change both meshes'."""
    excitations = tuple(
        analytic_excitation(
            make_figures(mesh, **figures),
            model,
            make_relief(mesh, relief) if relief else (),
            force,
            harmonics,
        )
        for mesh in range(2)
    )
    return LumpedSystem(make_idler() if train is None else train, excitations)


def make_fixed(periods: int = 4, **changes) -> Settings:
    """Settings that march `periods` (4 or more) and then record one, settled or not."""
    values = {"max_periods": periods, "multiples": 1, "tolerance": 1e-12, "windows": 1}
    return Settings(**(values | changes))


@pytest.fixture(scope="session")
def idler() -> Callable[..., Train]:
    return make_idler


@pytest.fixture(scope="session")
def figures() -> Callable[..., StiffnessParameters]:
    return make_figures


@pytest.fixture(scope="session")
def relief() -> Callable[..., list[tuple[float, float]]]:
    return make_relief


@pytest.fixture(scope="session")
def system() -> Callable[..., LumpedSystem]:
    return make_system


@pytest.fixture(scope="session")
def fixed() -> Callable[..., Settings]:
    return make_fixed


@pytest.fixture
def uncompiled(monkeypatch) -> None:
    """All kernels as plain Python for one test."""
    from lumped.kernels import convergence, dopri5, mesh_force, rk4, tangent
    from lumped.kernels import excitation_at as excitation

    for module in (mesh_force, convergence, excitation, tangent, rk4, dopri5):
        for name, value in vars(module).copy().items():
            if hasattr(value, "py_func"):
                monkeypatch.setattr(module, name, value.py_func)
