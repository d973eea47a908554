"""Limits of a torque [N m], wherever one is given."""

from __future__ import annotations

from lumped.common.options import Range

MIN_TORQUE = 1e-6  # less is lost in round-off of the no-load transmission error
MAX_TORQUE = 1e9
TORQUE = Range(least=MIN_TORQUE, below=MAX_TORQUE, unit="N m")
TORQUE_LIMITS = "at least 1e-6 and below 1e9 N m"  # the same in messages
