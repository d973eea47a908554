"""Fields of gears in contact, where they stand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from conftest import make_gear
from scipy.spatial import cKDTree
from sector_stress import nodal_state
from skfem import Basis, ElementTriP2, ElementVector, MeshTri2, condense, solve
from skfem.models.elasticity import linear_elasticity

from fegear.contact.loads import PatchLoad, patch_loads
from fegear.contact.plane.solve import run_kernel
from fegear.elasticity import halfplane
from fegear.elasticity.body_stress import ToothLoad, nodal_stress
from fegear.elasticity.halfplane import hat_displacement
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import CyclicSector
from fegear.gearset import load_gear_set
from fegear.rendering.fields import contact_field, mesh_scene
from fegear.rendering.loaded_gears import LoadedGear, LoadedMesh, MeshSide
from fegear.rendering.mesh_scene import MeshScene, RelativePose
from fegear.rendering.sector_field import MIRROR, MIRROR_STATE, loadable_gear
from fegear.statics.settings import StaticsSettings
from meshes import MeshSize, sector_mesh
from meshes.profile import flank_frame, turn
from validation.oracles import hertz

TORQUE = 100.0  # N m
ROLES = ("driver", "driven")


@pytest.fixture(scope="module")
def scene(compliance_cache) -> MeshScene:
    return mesh_scene(load_gear_set("liu-pair"), 0, StaticsSettings())


@pytest.fixture(scope="module")
def mirrored(compliance_cache) -> MeshScene:
    """Its driver turns clockwise, and there is friction."""
    settings = StaticsSettings(friction=0.1)
    return mesh_scene(load_gear_set("liu-idler"), 1, settings)


def loaded_sectors(scene, role, position) -> tuple[list[PatchLoad], dict]:
    loads = patch_loads(scene.problem, TORQUE, position)
    mesh = LoadedMesh(scene, RelativePose(position, 0.0), loads)
    gear = LoadedGear((MeshSide(mesh, role),))
    sectors = gear.sectors(scene.view("tooth", 1.6))
    return loads, {sector.tooth: sector for sector in sectors}


@pytest.mark.parametrize("angle", [0.0, 0.5 * math.pi])
def test_displacement_under_a_hat_is_that_of_many_line_loads(angle):
    half, turn = 3e-4, 0.7
    inward = np.array([math.cos(turn), math.sin(turn)])
    side = np.array([-inward[1], inward[0]])
    origin = np.array([1e-3, 2e-3])
    depth = np.array([1e-5, 1e-4, 5e-4, 3e-3, 2e-2])[:, None]
    points = (
        origin + depth * inward + np.array([[-4e-4], [0], [2e-4], [1e-3], [0]]) * side
    )
    t, weight = np.polynomial.legendre.leggauss(400)
    direct = np.zeros_like(points)
    for low, high in ((-1.0, 0.0), (0.0, 1.0)):
        abscissas = 0.5 * (high + low) + 0.5 * (high - low) * t
        for x, w in zip(abscissas, 0.5 * (high - low) * weight, strict=True):
            point = origin + half * x * side
            unit = halfplane.displacement(points, point, inward, 2e11, 0.3, angle)
            direct += w * (1.0 - abs(x)) * unit
    forces = (math.cos(angle), math.sin(angle))
    displacement = hat_displacement(points, origin, inward, half, forces, (2e11, 0.3))
    np.testing.assert_allclose(
        displacement, direct, rtol=1e-5, atol=1e-6 * np.abs(direct).max()
    )


def test_displacement_and_stress_of_a_hat_obey_hooke():
    inward, origin, half = np.array([0.0, -1.0]), np.zeros(2), 1e-4
    E, nu = 2e11, 0.3
    point, step = np.array([[5e-5, -8e-5]]), 1e-8
    for forces in ((1.0, 0.0), (0.0, 1.0)):
        displacements = [
            hat_displacement(point + d, origin, inward, half, forces, (E, nu))[0]
            for d in step * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
        ]
        slope = np.stack(
            [displacements[0] - displacements[1], displacements[2] - displacements[3]]
        ) / (2.0 * step)
        xx, yy, xy = halfplane.hat_stress(point, origin, inward, half, *forces)[0]
        scale = max(abs(xx), abs(yy), abs(xy))
        assert E * slope[0, 0] == pytest.approx(xx - nu * yy, abs=1e-5 * scale)
        assert E * slope[1, 1] == pytest.approx(yy - nu * xx, abs=1e-5 * scale)
        shear = 0.5 * E / (1.0 + nu) * (slope[0, 1] + slope[1, 0])
        assert shear == pytest.approx(xy, abs=1e-5 * scale)


@pytest.mark.parametrize("position", [0.0, 0.37])
@pytest.mark.parametrize("name", ["scene", "mirrored"])
def test_flanks_touch_on_the_line_of_action(name, position, request):
    scene = request.getfixturevalue(name)
    pair = scene.mesh.pair
    roll = pair.pitch_point + position * pair.base_pitch
    rolls = {"driver": roll, "driven": pair.line_of_action - roll}
    points = []
    for role in ROLES:
        gear = getattr(pair, role)
        arc = 0.5 * (gear.tip_roll_length**2 - rolls[role] ** 2) / gear.base_radius
        flank, inward = flank_frame(gear, np.array([arc]))
        frame = scene.frame(role, position)
        points.append(frame.places(flank)[0])
        # the centre is on the inner side, and the normals are opposite
        assert frame.vectors(inward)[0] @ (frame.center - points[-1]) > 0.0
    np.testing.assert_allclose(points[0], points[1], atol=1e-12)
    np.testing.assert_allclose(points[0], scene.on_path(roll), atol=1e-12)


@pytest.mark.parametrize("position", [0.0, 0.15, 0.5])
@pytest.mark.parametrize("name", ["scene", "mirrored"])
def test_flanks_yield_by_what_closes_the_gap(name, position, request):
    """Both gears' inward displacement is ste less gap at every loaded node."""
    scene = request.getfixturevalue(name)
    problem = scene.problem
    solved = run_kernel(problem, np.array([TORQUE]), np.array([position]))
    ste = solved.rows.ste[0, 0]
    gears = {role: loaded_sectors(scene, role, position) for role in ROLES}
    for load in gears["driver"][0]:
        pair = list(solved.teeth).index(load.tooth)
        lever = solved.patches[pair].moment_arms[0] / problem.pair.driver.base_radius
        closed = ste * lever - solved.nodes[pair].gap
        yielding = np.zeros(len(load.normal))
        for role, sign in (("driver", 1), ("driven", -1)):
            arcs = getattr(load, f"{role}_arcs")
            flank, inward = flank_frame(getattr(problem.pair, role), arcs)
            state = gears[role][1][sign * load.tooth].at(flank)
            yielding += np.einsum("ic,ic->i", state[:, :2], inward)
        touching = load.normal > 0.0
        np.testing.assert_allclose(yielding[touching], closed[touching], rtol=1e-2)


@pytest.mark.parametrize("role", ROLES)
def test_displacement_is_continuous_across_the_cuts(scene, role):
    _, sectors = loaded_sectors(scene, role, 0.5)
    mesh = next(iter(sectors.values())).body.sector.mesh
    cut, left_cut = (
        nodes[np.argsort(np.hypot(*mesh.points[nodes].T))]
        for nodes in (np.unique(mesh.edges[name]) for name in ("cut", "left_cut"))
    )
    largest = max(np.abs(nodal_state(s)[:, :2]).max() for s in sectors.values())
    assert len(sectors) > 5
    for tooth in sorted(sectors)[:-1]:
        here, next_one = (scene.frame(role, 0.5, t) for t in (tooth, tooth + 1))
        np.testing.assert_allclose(
            here.places(mesh.points[cut]),
            next_one.places(mesh.points[left_cut]),
            atol=1e-12,
        )
        one = here.vectors(nodal_state(sectors[tooth])[cut, :2])
        other = next_one.vectors(nodal_state(sectors[tooth + 1])[left_cut, :2])
        np.testing.assert_allclose(one, other, atol=1e-3 * largest)


def test_largest_shear_is_below_the_contact_where_hertz_has_it(scene):
    loads, sectors = loaded_sectors(scene, "driver", 0.0)
    (load,) = loads
    pair = scene.problem.pair
    radii = pair.pitch_point, pair.line_of_action - pair.pitch_point
    R = hertz.effective_radius(*radii)
    steel = hertz.Material(206e9, 0.3)
    modulus = hertz.effective_modulus(steel, steel, "strain")
    b = float(hertz.half_width(load.normal.sum(), R, modulus))
    peak = float(hertz.peak_pressure(load.normal.sum(), R, modulus))
    centre = load.normal @ load.driver_arcs / load.normal.sum()
    flank, inward = flank_frame(pair.driver, np.array([centre]))
    depth = np.linspace(0.2, 2.0, 361) * b
    line = flank + depth[:, None] * inward
    stress, local_stress = sectors[0].at(line)[:, 2:], sectors[0].local(line)[:, 2:]
    shear, alone = (
        np.hypot(0.5 * (xx - yy), xy) for xx, yy, xy in (stress.T, local_stress.T)
    )
    assert depth[shear.argmax()] == pytest.approx(0.786 * b, rel=5e-2)
    assert alone.max() == pytest.approx(0.300 * peak, rel=1e-2)
    # the bent tooth is stretched along this flank, which widens Mohr's circle
    along = np.array([-inward[0, 1], inward[0, 0]])
    xx, yy, xy = (stress - local_stress)[shear.argmax()]
    bending = along @ np.array([[xx, xy], [xy, yy]]) @ along
    assert bending > 0.0
    assert shear.max() - alone.max() == pytest.approx(0.5 * bending, rel=0.3)


def test_states_at_nodes_are_found_at_their_places(scene):
    """Points in elements with curved sides, and on their common corners."""
    _, sectors = loaded_sectors(scene, "driver", 0.5)
    for tooth in (0, 2):
        sector = sectors[tooth]
        nodes = np.arange(0, len(sector.body.sector.mesh.points), 7)
        state = sector.at(sector.body.sector.mesh.points[nodes])
        expected = nodal_state(sector)[nodes]
        for part in (slice(0, 2), slice(2, 5)):
            scale = np.abs(expected[:, part]).max()
            np.testing.assert_allclose(
                state[:, part], expected[:, part], atol=1e-7 * scale
            )


def test_refined_mesh_fills_the_same_area_with_the_same_state(scene):
    _, sectors = loaded_sectors(scene, "driver", 0.5)
    mesh = sectors[0].body.sector.mesh
    points, triangles, state = sectors[0].refined()
    assert len(triangles) > len(mesh.triangles)
    assert area(points, triangles) == pytest.approx(
        area(mesh.points, mesh.triangles), rel=1e-12
    )
    np.testing.assert_allclose(state[: len(mesh.points)], nodal_state(sectors[0]))
    fresh = np.arange(len(mesh.points), len(points), 50)
    scale = np.abs(state).max(axis=0)
    np.testing.assert_allclose(
        state[fresh] / scale, sectors[0].at(points[fresh]) / scale, atol=1e-7
    )
    plain = sectors[2].refined()
    np.testing.assert_array_equal(plain[1], mesh.triangles)


def area(points, triangles) -> float:
    """Of triangles with parabolic sides, by Green's theorem."""
    total = 0.0
    for side, middle in (((0, 1), 3), ((1, 2), 4), ((2, 0), 5)):
        a, b = (points[triangles[:, i]] for i in side)
        m = points[triangles[:, middle]]
        chord = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        bow = m - 0.5 * (a + b)
        bulge = (b - a)[:, 1] * bow[:, 0] - (b - a)[:, 0] * bow[:, 1]
        total += float((0.5 * chord + 2.0 / 3.0 * bulge).sum())
    return total


def test_von_mises_peaks_at_the_contact_and_in_the_loaded_fillets(scene):
    field = contact_field(scene, TORQUE, 0.0, scene.view("tooth", 1.6))
    (pair,) = field.pairs
    for role, gear in zip(ROLES, field.gears, strict=True):
        top = gear.points[gear.von_mises.argmax()]
        assert np.hypot(*(top - pair.center)) < 0.3e-3
        nodes = gear.fillet
        root = gear.points[nodes[gear.principal_1[nodes].argmax()]]
        # on the loaded tooth, on the side of the contact
        axis = scene.frame(role, 0.0).turn @ [0.0, 1.0]
        across = np.array([-axis[1], axis[0]])
        from_center, contact = root - gear.center, pair.center - gear.center
        assert (from_center @ across) * (contact @ across) > 0.0
        angle = math.atan2(abs(from_center @ across), from_center @ axis)
        body = scene.bodies[0 if role == "driver" else 1]
        assert angle < 0.5 * body.sector.gear.pitch_angle


def test_load_and_pressure_belong_together(scene):
    field = contact_field(scene, TORQUE, 0.5, scene.view("contact", 1.6))
    total = sum(pair.load for pair in field.pairs)
    expected = TORQUE / scene.problem.pair.driver.base_radius
    assert total == pytest.approx(expected, rel=1e-9)
    for pair in field.pairs:
        s = np.hypot(*np.diff(pair.points, axis=0).T)
        p = 0.5 * (pair.pressure[1:] + pair.pressure[:-1])
        load = p @ s * scene.problem.face_width
        assert load == pytest.approx(pair.load, rel=1e-3)


@pytest.mark.parametrize("name", ["scene", "mirrored"])
def test_hub_turn_keeps_the_flanks_together(name, request):
    """At the contact both gears move alike along the normal."""
    scene = request.getfixturevalue(name)
    field = contact_field(scene, TORQUE, 0.0, scene.view("contact", 1.6))
    (pair,) = field.pairs
    (load,), sectors = loaded_sectors(scene, "driven", 0.0)
    middle = int(load.normal.argmax())
    flank, _ = flank_frame(scene.problem.pair.driven, load.driven_arcs[[middle]])
    mate = scene.frame("driven", 0.0).vectors(sectors[0].at(flank)[:, :2])[0]
    normal = pair.normals[middle]
    assert mate @ normal > 0.0
    assert mate @ normal == pytest.approx(pair.motion[middle] @ normal, rel=1e-2)


def test_only_teeth_in_view_are_recovered(scene):
    near, far, whole = (
        contact_field(scene, TORQUE, 0.5, scene.view(zoom, 1.6)).gears[0].tooth
        for zoom in ("contact", "tooth", "gear")
    )
    assert len(np.unique(near)) < len(np.unique(far)) < len(np.unique(whole))
    assert len(np.unique(whole)) == scene.bodies[0].sector.gear.teeth


def test_turned_stress_keeps_its_invariants(mirrored):
    loads, sectors = loaded_sectors(mirrored, "driven", 0.2)
    frame = mirrored.frame("driven", 0.2, 1)
    tooth_frame = nodal_state(sectors[0])[:, 2:]
    world = frame.stresses(tooth_frame)
    for stress in (tooth_frame, world):
        xx, yy, xy = stress.T
        invariants = np.stack([xx + yy, xx * yy - xy**2])
    xx, yy, xy = tooth_frame.T
    expected = np.stack([xx + yy, xx * yy - xy**2])
    scale = np.abs(expected).max(axis=1, keepdims=True)
    np.testing.assert_allclose(invariants / scale, expected / scale, atol=1e-12)
    assert loads


def test_loads_are_taken_wherever_they_are(pinion):
    """A frictionless body takes no column of unit tangential loads."""
    sector = CyclicSector(pinion, PlaneMaterial(206e9, 0.3, "strain"))
    body = loadable_gear(sector, friction=False)
    assert len(body.unit_loads) == 1
    load = ToothLoad(0, np.array([2e-3]), 5e-5, np.array([1e5]), np.array([0.0]))
    (field,) = body.sectors([load], [0])
    (rotated_field,) = body.sectors([replace(load, tooth=3)], [3])
    np.testing.assert_allclose(nodal_state(rotated_field), nodal_state(field))


class DirectSolve:
    """All sectors of a gear merged into one mesh; shares only the mesh with fegear."""

    def __init__(self, gear, size):
        self.sector = sector_mesh(gear, size)
        angles = 2.0 * np.pi * np.arange(gear.teeth) / gear.teeth
        copies = np.vstack([turn(self.sector.points, angle) for angle in angles])
        near = cKDTree(copies).query_ball_point(copies, 1e-9)
        unique_nodes, merged = np.unique(
            [min(group) for group in near], return_inverse=True
        )
        shift = len(self.sector.points) * np.arange(gear.teeth)[:, None, None]
        nodes = merged[(self.sector.triangles + shift).reshape(-1, 6)]
        grid = MeshTri2(copies[unique_nodes].T.copy(), nodes.T.copy())
        self.basis = Basis(grid, ElementVector(ElementTriP2()), intorder=4)
        places = self.basis.doflocs.T
        self.held = np.hypot(*places.T) < gear.hub_radius * (1.0 + 1e-6)
        self.tree = cKDTree(places)

    def freedoms(self, points):
        return np.array([sorted(f) for f in self.tree.query_ball_point(points, 1e-9)])

    def displacement(self, freedoms, force, lame):
        load = np.zeros(self.basis.N)
        load[freedoms] = force
        stiffness = linear_elasticity(*lame).assemble(self.basis)
        return solve(*condense(stiffness, load, D=np.flatnonzero(self.held)))


def test_fields_are_those_of_a_direct_solve_of_the_whole_gear():
    """Away from a load at mid-flank: displacement of all teeth, stress of the root."""
    gear = make_gear(12, 5e-3, profile_shift=0.4, tip_radius=18.6e-3)
    material = PlaneMaterial(206e9, 0.3, "strain")
    size = MeshSize(flank_edges=40, flank_grading=0.0)
    direct = DirectSolve(gear, size)
    mesh, node = direct.sector, 17
    arc = mesh.flank_arcs[[node]]
    point, inward = flank_frame(gear, arc)
    E, nu = 206e9, 0.3
    lame = E * nu / (1.0 + nu) / (1.0 - 2.0 * nu), 0.5 * E / (1.0 + nu)
    u = direct.displacement(direct.freedoms(point)[0], 1e5 * inward[0], lame)

    body = loadable_gear(CyclicSector(gear, material, size), friction=False)
    load = ToothLoad(0, arc, 2e-5, np.array([1e5]), np.array([0.0]))
    for sector in body.sectors([load], range(-2, 4)):
        angle = sector.tooth * gear.pitch_angle
        expected = turn(u[direct.freedoms(turn(mesh.points, angle))], -angle)
        distance = np.hypot(*(mesh.points - point[0]).T)
        far = (distance > 0.5 * gear.module) | (sector.tooth != 0)
        displacement = nodal_state(sector)[far, :2]
        largest = np.abs(displacement).max()
        np.testing.assert_allclose(displacement, expected[far], atol=1e-3 * largest)
        if sector.tooth == 0:
            stress = nodal_stress(body.sector) @ field_of(body, expected)
            fillet = np.unique(mesh.edges["fillet"])
            trace = stress.reshape(3, -1)[:2, fillet].sum(axis=0).max()
            root = nodal_state(sector)[fillet, 2:4].sum(axis=1).max()
            assert root == pytest.approx(trace, rel=1e-2)


def test_loads_on_both_flanks_are_those_of_a_direct_solve_of_the_whole_gear():
    """A tooth's right flank and another's left one are loaded, as those of a planet."""
    gear = make_gear(12, 5e-3, profile_shift=0.4, tip_radius=18.6e-3)
    material = PlaneMaterial(206e9, 0.3, "strain")
    size = MeshSize(flank_edges=40, flank_grading=0.0)
    direct = DirectSolve(gear, size)
    mesh, E, nu = direct.sector, 206e9, 0.3
    lame = E * nu / (1.0 + nu) / (1.0 - 2.0 * nu), 0.5 * E / (1.0 + nu)
    mirror, behind = np.array([-1.0, 1.0]), 4
    angle = behind * gear.pitch_angle
    right, left = (flank_frame(gear, mesh.flank_arcs[[node]]) for node in (17, 25))
    places = right[0], turn(mirror * left[0], angle)
    forces = 1e5 * right[1][0], 6e4 * turn(mirror * left[1], angle)[0]
    u = sum(
        direct.displacement(direct.freedoms(place)[0], force, lame)
        for place, force in zip(places, forces, strict=True)
    )

    body = loadable_gear(CyclicSector(gear, material, size), friction=False)
    arcs = mesh.flank_arcs[[17]], mesh.flank_arcs[[25]]
    still = np.array([0.0])
    load = ToothLoad(0, arcs[0], 2e-5, np.array([1e5]), still)
    back = ToothLoad(-behind, arcs[1], 2e-5, np.array([6e4]), still)
    sectors = body.sectors([load], range(-3, 7), [back])
    assert [s.tooth for s in sectors if s.loads] == [0]
    assert [s.tooth for s in sectors if s.back_loads] == [behind]
    for sector in sectors:
        angle = sector.tooth * gear.pitch_angle
        expected = turn(u[direct.freedoms(turn(mesh.points, angle))], -angle)
        distance = np.min(
            [np.hypot(*(turn(mesh.points, angle) - p).T) for p in places], axis=0
        )
        far = distance > 0.5 * gear.module
        displacement = nodal_state(sector)[far, :2]
        largest = np.abs(displacement).max()
        np.testing.assert_allclose(displacement, expected[far], atol=1e-3 * largest)
        if sector.loads or sector.back_loads:
            stress = (nodal_stress(body.sector) @ field_of(body, expected)).reshape(
                3, -1
            )
            state = nodal_state(sector)[:, 2:4].sum(axis=1)
            for name in ("fillet", "left_fillet"):
                fillet = np.unique(mesh.edges[name])
                for largest_of in (np.max, np.min):
                    trace = largest_of(stress[:2, fillet].sum(axis=0))
                    assert largest_of(state[fillet]) == pytest.approx(trace, rel=1e-2)


def test_a_back_load_is_the_mirror_image_of_a_load(pinion):
    sector = CyclicSector(pinion, PlaneMaterial(206e9, 0.3, "strain"))
    body = loadable_gear(sector)
    load = ToothLoad(2, np.array([2e-3]), 5e-5, np.array([1e5]), np.array([2e4]))
    points = sector.mesh.points
    state = MIRROR_STATE * np.array(
        [s.at(points) for s in body.sectors([load], [2, 4])]
    )
    mirrored = body.sectors([], [-2, -4], [load])
    for one, other in zip(state, mirrored, strict=True):
        values = other.at(MIRROR * points)
        scale = np.abs(one).max(axis=0)
        np.testing.assert_allclose(values / scale, one / scale, atol=1e-7)


def field_of(body, nodal):
    """Displacement at the nodes (n, 2) as a vector of freedoms."""
    field = np.zeros(body.sector.basis.N)
    field[body.sector.node_dofs] = nodal
    return field
