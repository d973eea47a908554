"""One contact problem for all statics tests; its compliances take a second."""

from __future__ import annotations

import pytest

from fegear.contact.problem import ContactFlank, ContactProblem
from fegear.elasticity.cache import cached_flank_compliance
from fegear.elasticity.material import PlaneMaterial

STEEL = PlaneMaterial(206e9, 0.3)
WIDTH = 25.4e-3


@pytest.fixture(scope="session")
def pinion_flank(pinion, compliance_cache):
    return cached_flank_compliance(pinion, STEEL)


@pytest.fixture(scope="session")
def wheel_flank(wheel, compliance_cache):
    return cached_flank_compliance(wheel, STEEL)


@pytest.fixture(scope="session")
def problem(pair, pinion_flank, wheel_flank) -> ContactProblem:
    return ContactProblem(
        pair=pair,
        driver=ContactFlank(compliance=pinion_flank),
        driven=ContactFlank(compliance=wheel_flank),
        face_width=WIDTH,
    )
