"""A whole gear of finite elements some teeth of which are cracked.

It repeats sector meshes around the axis, merges the nodes on their cuts alone, holds
the hub and solves directly; it shares only the meshes with the program.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree
from skfem import Basis, ElementTriP2, ElementVector, MeshTri2
from skfem.models.elasticity import linear_elasticity

from fegear.elasticity.plane_elements import dofs_of_nodes
from meshes import sector_mesh
from meshes.cracked_sector import cracked_sector_mesh
from meshes.profile import flank_frame, turn


class CrackedGear:
    def __init__(self, gear, size, material, cracks):
        self.gear, self.material = gear, material
        healthy = sector_mesh(gear, size)
        self.meshes = [
            cracked_sector_mesh(gear, size, cracks[tooth])
            if tooth in cracks
            else healthy
            for tooth in range(gear.teeth)
        ]
        counts = [len(mesh.points) for mesh in self.meshes]
        self.first = np.append(0, np.cumsum(counts))
        copies = np.vstack(
            [turn(m.points, gear.pitch_angle * k) for k, m in enumerate(self.meshes)]
        )
        row = self._merged(copies)
        unique, self.node = np.unique(row, return_inverse=True)
        self.triangles = self.node[
            np.vstack(
                [
                    m.triangles + f
                    for m, f in zip(self.meshes, self.first[:-1], strict=True)
                ]
            )
        ]
        self.points = copies[unique]
        mesh = MeshTri2(self.points.T.copy(), self.triangles.T.copy())
        self.basis = Basis(mesh, ElementVector(ElementTriP2()), intorder=4)
        self.dofs = dofs_of_nodes(self.basis, self.triangles, 2)
        stiffness = linear_elasticity(*material.lame).assemble(self.basis).tocsc()
        radius = gear.sign * np.hypot(*self.basis.doflocs)
        self.free = np.flatnonzero(
            radius > gear.hub_radius + 1e-6 * abs(gear.hub_radius)
        )
        self.factor = splu(stiffness[self.free][:, self.free])

    def _merged(self, copies):
        """Row of the first of equal nodes on cuts."""
        names = ("cut", "left_cut")
        on_cuts = np.concatenate(
            [
                np.unique(np.vstack([m.edges[n] for n in names])) + f
                for m, f in zip(self.meshes, self.first[:-1], strict=True)
            ]
        )
        near = cKDTree(copies[on_cuts]).query_ball_point(copies[on_cuts], 1e-9)
        row = np.arange(len(copies))
        row[on_cuts] = [on_cuts[min(others)] for others in near]
        return row

    def flank(self, tooth, side=0):
        """Freedoms (n, 2), inward and rootward normals of the points of a flank."""
        mesh = self.meshes[tooth]
        inner = slice(1, -1) if self.gear.is_undercut else slice(1, None)
        _, inward = flank_frame(self.gear, mesh.flank_arcs[inner])
        rootward = np.stack([-inward[:, 1], inward[:, 0]], axis=1)
        nodes = mesh.flank_nodes[inner]
        if side:
            edges = mesh.edges["left_flank"]
            nodes = np.append(edges[:, 0], edges[-1, 1])[inner]
            inward, rootward = inward * [-1, 1], rootward * [-1, 1]
        angle = self.gear.pitch_angle * tooth
        dofs = self.dofs[self.node[nodes + self.first[tooth]]]
        return dofs, turn(inward, angle), turn(rootward, angle)

    def displacement(self, tooth, points, side=0):
        """Displacement (freedoms, points) under unit normal loads on some points."""
        dofs, inward, _ = self.flank(tooth, side)
        force = np.zeros((self.basis.N, len(points)))
        for column, point in enumerate(points):
            force[dofs[point], column] = inward[point]
        u = np.zeros_like(force)
        u[self.free] = self.factor.solve(np.ascontiguousarray(force[self.free]))
        return u

    def on_flank(self, u, tooth, side=0):
        """Normal and rootward displacement (2, n, points) of a flank."""
        dofs, *directions = self.flank(tooth, side)
        return np.stack([np.einsum("icj,ic->ij", u[dofs], d) for d in directions])
