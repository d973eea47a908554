"""Which files of tests have the mark `blas`."""

from __future__ import annotations

import pytest
from blas_tests import ROOT, uses_linear_algebra


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("tests/fegear/elasticity/test_flank.py", True),  # solves
        ("tests/lumped/stability/test_stability.py", True),  # eigenvalues
        ("tests/fegear/contact/test_face.py", True),  # by a module that it imports
        ("tests/meshes/test_crack.py", False),  # geometry
        ("tests/lumped/clatter/test_impact.py", False),
        ("tests/fegear/commands/stiffness/test_stiffness.py", False),
    ],
)
def test_files_of_linear_algebra_have_the_mark(path, expected):
    assert uses_linear_algebra(ROOT / path) == expected


def test_the_mark_is_set(request):
    assert request.node.get_closest_marker("blas") is None
