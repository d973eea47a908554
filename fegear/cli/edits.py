"""Changes of a gear set for one run, given by --set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fegear.cli.lumped_options import Physics

FIGURES = ("mean_stiffness_N_per_m", "stiffness_variation", "load_share")
OF_TRANSLATIONS = ("mass_kg", "bearing_kx_N_per_m", "bearing_ky_N_per_m")
OPTIONS = {"load.torques_Nm": "torque", "dynamics.damping_ratio": "damping"}


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


def edits_in_words(header: Mapping[str, str]) -> str:
    """`KEY = VALUE, ...` of the entries in a header, for a title."""
    changes = (item for item in header.items() if item[0].startswith("set "))
    return ", ".join(f"{key[4:]} = {value}" for key, value in changes)


def refuse_idle_edits(edits: Mapping[str, Any], physics: Physics) -> None:
    """Refuse --set of a key that nothing of the run reads."""
    from fegear.cli.lumped_options import ExcitationChoice
    from fegear.errors import InputError

    for key in edits:
        name = key.rpartition(".")[2]
        if physics.kind is ExcitationChoice.fe and name in FIGURES:
            raise InputError(
                f"--set {key}; finite elements or a table take its place, leave it out "
                "or choose another --excitation"
            )
        if not physics.translations and name in OF_TRANSLATIONS:
            raise InputError(f"--set {key}; changes nothing without --translations")
