"""The smallest case of a validation that moves, as a file and as a value."""

from __future__ import annotations

from validation.study.cases import read_case

TEXT = """
name = "{name}"
title = "Tiny"
gear_set = "liu-pair"
torques_Nm = [100]
speeds_Hz = "{speeds}"
fidelity = "quasistatic"

[[model]]
number = 1

[[metric]]
name = "rms_distance"
allowed = {allowed}
reason = "for a test"
"""


def case_text(name="tiny", speeds="1000:1200:50", allowed=0.5):
    """TOML; speeds [Hz] and the RMS distance that is allowed."""
    return TEXT.format(name=name, speeds=speeds, allowed=allowed)


TINY = read_case(case_text())
