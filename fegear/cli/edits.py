"""Changes of a gear set for one run, given by --set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fegear.cli.groups import option
from fegear.cli.options import SetName

if TYPE_CHECKING:
    from fegear.gearset.model import GearSet

FIGURES = ("mean_stiffness_N_per_m", "stiffness_variation", "load_share")
OF_TRANSLATIONS = ("mass_kg", "bearing_kx_N_per_m", "bearing_ky_N_per_m")
OPTIONS = {"load.torques_Nm": "torque", "dynamics.damping_ratio": "damping"}


@dataclass(frozen=True, kw_only=True)
class EditedSet:
    """A gear set, and what is changed in it for one run."""

    set_name: SetName
    edits: list[str] | None = option(
        "Change a key of the gear set for this run, such as "
        "mesh.1.tip_relief.magnitude_um=10; may be repeated.",
        "--set",
        metavar="KEY=VALUE",
    )

    def load(self, **options: Any) -> tuple[GearSet, dict[str, Any]]:
        """The gear set as changed, and the changes; see `parsed_edits`."""
        from fegear.gearset import load_gear_set

        changes = parsed_edits(self.edits, **options)
        return load_gear_set(self.set_name, changes), changes


def parsed_edits(given: Sequence[str] | None, **options: Any) -> dict[str, Any]:
    """Values by key; InputError where there is no `=` or a key comes twice.

    options : by name, which are stronger than a key where they are given
    """
    from fegear.errors import InputError
    from fegear.gearset.edit import parsed_value

    edits: dict[str, Any] = {}
    for text in given or ():
        key, separator, value = (part.strip() for part in text.partition("="))
        if not (separator and key and value):
            raise InputError(f"--set {text}; KEY=VALUE is needed")
        if key in edits:
            raise InputError(f"--set {text}; {key} is given more than once")
        if options.get(OPTIONS.get(key, "")) not in (None, []):
            raise InputError(f"--set {text}; --{OPTIONS[key]} replaces it")
        edits[key] = parsed_value(value)
    return edits


def edit_entries(edits: Mapping[str, Any]) -> dict[str, str]:
    """Entries for the header of a file: what was changed."""
    return {f"set {key}": str(value) for key, value in edits.items()}


def refuse_idle_edits(
    edits: Mapping[str, Any], *, translations: bool, figures: bool = False
) -> None:
    """Refuse --set of a key that nothing of the run reads.

    translations : whether gears move on their bearings
    figures : whether key figures of the mesh stiffness are read
    """
    from fegear.errors import InputError

    for key in edits:
        name = key.rpartition(".")[2]
        if name in FIGURES and not figures:
            raise InputError(
                f"--set {key}; finite elements or a table take its place, leave it out "
                "or choose another --excitation"
            )
        if name in OF_TRANSLATIONS and not translations:
            raise InputError(f"--set {key}; changes nothing without --translations")
