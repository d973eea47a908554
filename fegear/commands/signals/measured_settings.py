"""Settings of signals that are measured, beside those that are computed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from fegear.files.errors import InputError
from fegear.files.recordings import RECORDING_FILE
from fegear.studies.settings import (
    SettingsGroup,
    display_name,
    exposed_fields,
    group_of,
    refusal,
    refuse_non_default,
    setting,
)
from fegear.studies.trains.recording_settings import RecordingSettings
from fegear.studies.trains.speeds import refuse_both

OF_RECORDING = ("channels", "tacho", "speed_channel", "rate", "computed")
OF_COMPUTED = ("torque", "table", "turns", "from_speed", "from_rpm")
SPEEDS = ("speed", "rpm")
NEEDS_COMPUTED = "needs {computed}"


@dataclass(frozen=True, kw_only=True)
class MeasuredSettings(RecordingSettings):
    """Which recording is treated as computed signals are, and how its gear turns."""

    measured: str | None = setting(
        None,
        f"Recording of a measurement ({RECORDING_FILE}), whose channels are averaged "
        "over turns of the gears. [default: none]",
        metavar="FILE",
        reads=True,
    )
    computed: bool = setting(
        True, "Compute signals at the mean speed of the recording beside it."
    )

    def __post_init__(self) -> None:
        if self.measured is not None:
            self._require_rotation()
        super().__post_init__()  # type: ignore[misc]
        self._refuse_unused()
        if self.measured is None:
            return
        for name in SPEEDS:
            if isinstance(getattr(self, name), tuple):
                shown = f"{display_name(self, name)} is a ramp"
                raise InputError(
                    f"{shown}; of {display_name(self, 'measured')} a constant speed is "
                    f"allowed, or {display_name(self, 'tacho')} or "
                    f"{display_name(self, 'speed_channel')}"
                )
        if not self.computed:
            self._refuse_settings_of_computed()

    def _require_rotation(self) -> None:
        refuse_both(self, "tacho", "speed_channel")
        names = ("tacho", "speed_channel", *SPEEDS)
        if all(getattr(self, name) is None for name in names):
            *others, last = (display_name(self, name) for name in names)
            raise InputError(
                f"{display_name(self, 'measured')} = {self.measured}; "
                f"{', '.join(others)} or {last} is needed for the rotation"
            )

    def _refuse_unused(self) -> None:
        """Refuse settings that are not the default and would change nothing."""
        defaults = {m.name: m.default for m in exposed_fields(group_of(self))}
        for name, reason in self._unused_settings():
            if getattr(self, name) != defaults[name]:
                raise refusal(self, name, reason)

    def _refuse_settings_of_computed(self) -> None:
        """Refuse settings of the model and of its integration."""
        for member in exposed_fields(group_of(self)):
            value, group = getattr(self, member.name), member.group
            if group is not None and member.name in ("model", "integration"):
                _refuse_group(value, group, display_name(self, "computed"))

    def _unused_settings(self) -> Iterator[tuple[str, str]]:
        """Settings that would change nothing, with the reason."""
        if self.measured is None:
            yield from ((name, "needs {measured}") for name in OF_RECORDING)
            return
        for name in ("noise_percent", "seed"):
            yield name, "{measured} has noise of its own"
        if not self.needs_speed:
            rotation = "speed_channel" if self.tacho is None else "tacho"
            yield from ((name, f"{{{rotation}}} gives the speed") for name in SPEEDS)
        if self.tacho is None:
            yield "pulses", "needs {tacho}"
        if not self.computed:
            yield from ((name, NEEDS_COMPUTED) for name in OF_COMPUTED)


def _refuse_group(value: Any, group: SettingsGroup, computed: str) -> None:
    """Refuse all settings of a group, and of groups in it."""
    for member in exposed_fields(group):
        inner = getattr(value, member.name)
        if member.group is None:
            refuse_non_default(value, [member.name], f"needs {computed}", group)
        elif isinstance(inner, member.group.kind):
            _refuse_group(inner, member.group, computed)
