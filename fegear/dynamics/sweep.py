"""Speed sweeps of a dynamic model, kept in a checkpoint as they go."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.dynamics.respond import (
    DynamicSettings,
    Motion,
    MotionState,
    Stepper,
    Watch,
    lost,
    respond,
)
from fegear.errors import file_error
from fegear.store import Checkpoint
from lumped.response import FIGURES, Response, Status
from lumped.sweep import Branch, Direction

Array = NDArray[np.float64]
Keep = Callable[[float, Motion], None]  # (frequency [Hz], what was recorded there)


class Stopped(Exception):
    """A run that was asked to end."""


def sweep_branch(
    stepper: Stepper,
    frequencies: Sequence[float],
    direction: Direction,
    settings: DynamicSettings,
    *,
    checkpoint: Checkpoint | None = None,
    name: str = "",
    keep: Keep = lambda frequency, motion: None,
    passed: Callable[[], None] = lambda: None,
    watch: Watch = lambda frequency, period: None,
    stop: threading.Event | None = None,
) -> Branch:
    """Pass through mesh frequencies [Hz], each from where the one before settled.

    checkpoint, name : where finished speeds are found and kept, and the branch's name
    keep : called with the motion of a speed before it counts as finished
    passed : called after each speed; watch : after each period, see `respond`
    stop : ends the sweep after the period that runs
    """

    def watched(frequency: float, period: int) -> None:
        if stop is not None and stop.is_set():
            raise Stopped
        watch(frequency, period)

    ordered = sorted(frequencies, reverse=direction == "down")
    responses: list[Response] = []
    state: MotionState | None = None
    if checkpoint is not None:
        responses = [_response(values) for values in checkpoint.finished(name)]
        state = kept_state(checkpoint, name)
    for _ in responses:
        passed()
    finite = all(r.status != Status.DIVERGED for r in responses)
    for index in range(len(responses), len(ordered)):
        if not finite:
            break
        frequency = ordered[index]
        before = ordered[index - 1] if index else None
        try:
            response, motion, state = respond(
                stepper, frequency, settings, state, before, watched
            )
            keep(frequency, motion)
        except Stopped:
            break
        except FloatingPointError:
            finite = False
            at = stepper.start() if state is None else state
            response, state = lost(stepper.model, frequency, at), at
        responses.append(response)
        if checkpoint is not None:
            try:
                checkpoint.add(name, _values(response), _arrays(state))
            except OSError as error:
                raise file_error(checkpoint.path, "written", error) from None
        passed()
    complete = finite and len(responses) == len(ordered)
    return Branch(stepper.model.reference, direction, tuple(responses), complete)


def kept_state(checkpoint: Checkpoint, name: str) -> MotionState | None:
    """Where the last finished speed of a branch has settled, None before the first."""
    arrays = checkpoint.state(name)
    return None if arrays is None else _state(arrays)


def _arrays(state: MotionState) -> dict[str, Array]:
    fields = {f"field{i}": field for i, field in enumerate(state.fields)}
    return {"motion": state.motion, "touch": state.contact} | fields


def _state(arrays: dict[str, Array]) -> MotionState:
    fields = tuple(arrays[f"field{i}"] for i in range(len(arrays) - 2))
    return MotionState(arrays["motion"], arrays["touch"], fields)


def _values(response: Response) -> dict[str, Any]:
    """Plain values of a response, its state left out."""
    values = {}
    for entry in fields(response):
        value = getattr(response, entry.name)
        if entry.name == "state":
            continue
        if isinstance(value, np.ndarray):
            value = value.tolist()
        values[entry.name] = str(value) if entry.name == "status" else value
    return values


def _response(stored: Mapping[str, Any]) -> Response:
    values = dict(stored)
    values |= {name: np.array(values[name], float) for name in FIGURES}
    values["period_multiple"] = np.array(values["period_multiple"], np.int64)
    values["status"] = Status(values["status"])
    return Response(**values, state=np.empty((0, 0)))
