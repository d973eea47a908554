"""One real factorisation for all nodal diameters, beside a complex one for each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import make_gear, make_helical
from slow_tests import first_are_quick
from whole_gear import small_ring

from fegear.elasticity.condensed_width import (
    FreeCuts,
    ring_tables,
    spaced_diameters,
    width_tables,
)
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.ring import nodal_diameter_phase
from fegear.elasticity.sector import RIGHT, cyclic_sector
from fegear.elasticity.twisted_sector import TwistedSector
from fegear.elasticity.wide_sector import WideSector
from fegear.elasticity.width_functions import layered_polynomials, polynomials
from meshes import MeshSize
from meshes.internal import Foundation

WIDTH, TEETH = 12e-3, 13
STEEL = PlaneMaterial(206e9, 0.3)
SMALL = MeshSize(
    flank_edges=6, flank_grading=3.0, fillet_edges=3, tooth_size=0.6, hub_size=2.4
)


def sector_of(kind):
    if kind.startswith("ring"):
        gear = small_ring(2 * TEETH)
        if kind == "ring on springs":
            gear = replace(gear, foundation=Foundation(radial=2e13, tangential=1e13))
    elif kind == "helical":
        gear = make_helical(TEETH, 6e-3, 20.0)
    else:
        gear = make_gear(TEETH, 6e-3)
    return cyclic_sector(gear, STEEL, SMALL)


@pytest.mark.parametrize(
    "kind", first_are_quick(["helical", "ring on springs", "spur", "ring"], 1)
)
def test_tables_are_those_of_a_factorisation_for_each_diameter(kind):
    sector = sector_of(kind)
    twisted, teeth = TwistedSector(sector), sector.gear.teeth
    functions = layered_polynomials(WIDTH, 2, [1e-3])
    wide = WideSector(twisted, functions, (0, 1, 2))
    every = np.arange(teeth // 2 + 1)

    def harmonic(diameters):
        phase = nodal_diameter_phase(int(diameters), teeth)
        ties = sector.cyclic_constraint(phase), twisted.axial_constraint(phase)
        return wide.solve(ties)

    spectrum = np.stack([harmonic(n) for n in every])
    scale = np.abs(spectrum).max()
    nodes = sector.flanks[RIGHT].dofs
    tables = width_tables(wide, every, nodes)
    for of_kind, table in enumerate((tables.normal, tables.rootward)):
        expected = ring_tables(spectrum[:, of_kind], every, teeth)
        assert np.abs(table - expected).max() < 1e-10 * scale
    # what chosen nodes do on the flank is what is measured there
    of_section, along = twisted.flank_normals
    points = np.arange(len(nodes))
    normals = np.column_stack(
        [of_section[nodes[:, c], points] for c in range(2)]
        + [along[twisted.node_of[nodes[:, 0]], points]]
    )
    by_function = np.einsum("pc,tpcfnl->tpfnl", normals, tables.nodes)
    measured = np.einsum("kf,tpfnl->tpknl", functions.mass[:3], by_function)
    assert np.abs(measured - tables.normal).max() < 1e-10 * scale
    normal = width_tables(wide).normal
    exact = ring_tables(spectrum[:, 0], every, teeth)
    assert np.abs(normal - exact).max() < 1e-4 * np.abs(exact).max()
    assert spaced_diameters(teeth)[-1] == teeth // 2


def test_free_cuts_are_tied_by_the_phase():
    sector = sector_of("spur")
    cuts = FreeCuts.of(sector.cyclic_constraint, len(sector.cut) // 2)
    matrix, n, m = cuts.matrix.toarray(), cuts.interior, cuts.cut
    for phase in (1.0, -1.0, np.exp(0.7j)):
        tied = np.hstack(
            [matrix[:, :n], matrix[:, n : n + m] + phase * matrix[:, n + m :]]
        )
        expected = sector.cyclic_constraint(phase).toarray()
        assert np.abs(tied - expected).max() < 1e-15


@pytest.mark.parametrize("degree", [3, 4])
def test_functions_of_the_ends_follow_the_polynomials_by_parity(degree):
    layered = layered_polynomials(WIDTH, degree, [1e-3, 3e-4])
    plain, count = polynomials(WIDTH, degree), degree + 1
    assert layered.values[:, :count] == pytest.approx(plain.values, abs=1e-12)
    assert layered.mass[:count, :count] == pytest.approx(plain.mass, abs=1e-15)
    number = np.arange(layered.values.shape[1])
    mixed = np.add.outer(number, number) % 2 == 1
    # functions of other parity have no integral of their product
    assert np.abs(layered.mass[mixed]).max() < 1e-14 * layered.mass.max()
    half = len(layered.values) // 2
    slope = np.gradient(layered.values[:half, -1], np.cumsum(layered.weights)[:half])
    assert layered.slopes[:half, -1][50:90] == pytest.approx(
        slope[50:90], rel=0.1, abs=1e-3 * np.abs(slope).max()
    )
