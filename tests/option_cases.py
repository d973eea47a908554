"""For each option of each command another value, and what it needs beside it.

A case is a short use of a command and the same with the other value. Values are the
same for all commands that have an option, flags and files are derived; what a command
needs in addition is in its `short_use.toml`:

    [sweep.options]
    "--table" = { beside = "--model 3", without = "--excitation", value = "TABLE" }

value : of the option; beside : words of both runs; without : options of the short use
that both leave out; instead : options whose place it takes; set : another gear set;
refused : whether the option is
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any, Literal, NamedTuple, get_args, get_origin

from cli_commands import commands
from short_uses import FLAG, SHORT_USES, text_of, words_of

from fegear.studies import load_study
from fegear.studies.settings import (
    ExposedField,
    Setting,
    SettingsGroup,
    exposed_fields,
    group_of,
)

SECOND_VALUES = words_of(
    """
    --addendum 0.9 --along b --at 4000 --band 3000,4000 --bearings linear --bending 0.2
    --beta 0.5 --body free --bore 3 --center-distance-um 1 --compromises 3
    --cutoff 30000 --cycles 1e7 --damping-ratio 0.1 --dedendum 1.2 --delta 0.55
    --depth-step-um 0.001 --designs 1 --direction up --distribution uniform
    --doublings 0 --drag-Nm 2 --driven-grade 5 --driven-inertia-kgm2 0.1
    --driven-share 0.3 --driver-grade 5 --driving-inertia-kgm2 0.1 --eccentricity 4
    --eccentricity-um 8 --elastic-damping 0.5 --elements 3 --epsilon 0.09
    --excitation trapezoid --excitation-harmonics 1 --face-width 12 --fidelity reduced
    --field pressure --frames 4 --friction 0.1 --from-rpm 7010 --from-speed 2101
    --gear b --grade 5 --grid 14 --harmonic-count 2 --harmonics 2 --history h
    --impacts 20 --inertia-kgm2 0.1 --iterations 100 --kappa 1000 --length 2
    --length-tolerance 0.05 --load 500 --map fermi --max-liftoffs 2 --max-periods 40
    --max-relief-um 1 --max-rpm 9000 --mean 1.1e8 --mean-std 0.1 --mesh 2
    --method dopri5 --model 2 --modes 2 --noise-percent 1 --objective mean
    --only statics --orbit P(1,1,0) --period-multiple 1 --plane strain --points 4
    --position 0.5 --positions 12 --preimages 1 --plot other.png --pressure-angle 22
    --profile-form-um 1 --profile-slope-um 1 --pulses 8 --radius 21 --ramp 0.05
    --random 3 --random-seed 1 --ratio 2 --relief-stiffness unmodified
    --relief-tolerance-um 1 --restitution 0.9 --root-stress a --rpm 7000 --runs 3
    --samples 12 --scale 100 --scheduler nowhere --sections 7 --seed 2
    --set gear.1.teeth=21 --shape parabolic --single-pitch-um 1
    --sliding instantaneous --solver shooting --spacing 0.02 --speed 4000
    --speed-rpm 1500 --starts 1 --steepness 1 --steps 8 --stiffness fe
    --sweep-points 2 --table TABLE --teeth 30 --tolerance 0.1 --tooth 2 --torque 30
    --torque-of input --transition-speed 0.05 --turns 3 --variation 0.35
    --variation-std 0.1 --velocity 0:4 --wear-coefficient 1e-17 --wheel second
    --width 640 --window 1 --without body --zoom gear
    """
)
ARGUMENTS = {"SET": "OTHER", "roots-scaled": "SOFT"}
# of all commands: what an option needs beside it, and leaves out
COARSE, ELEMENTS = "--resolution coarse", "--excitation"
NEEDS: Mapping[str, dict[str, Any]] = {
    **{
        name: {"refused": True}
        for name in ("--all", "--overwrite", "--resume", "--scheduler", "--stress")
    },
    "--averages": {"beside": "-o s.mat"},
    "--bearings": {"beside": "--translations", "set": "rolling"},
    "--cluster": {"value": "--scheduler tcp://nowhere:1", "refused": True},
    "--excitation-harmonics": {"beside": "--excitation fourier"},
    "--friction": {"beside": COARSE, "without": ELEMENTS},
    "--max-periods": {"beside": "--damping-ratio 1e-4"},
    "--mesh": {"set": "train"},
    "--motion": {
        "value": "space",
        "set": "bent",
        "beside": f"{COARSE} --plane width",
        "without": ELEMENTS,
    },
    "--plane": {"beside": COARSE, "without": ELEMENTS},
    "--ramp": {"beside": "--excitation trapezoid"},
    "--random-seed": {"beside": "--random 3"},
    "--relief-stiffness": {
        "beside": f"{COARSE} --model 1 --set mesh.1.tip_relief.magnitude_um=10",
        "without": ELEMENTS,
    },
    "--resolution": {"without": ELEMENTS},
    **{name: {"instead": "--speeds --speed --at"} for name in ("--band", "--rpm")},
    "--shafts": {"set": "bent", "value": "off"},
    "--table": {"beside": "--model 3", "without": ELEMENTS},
    "--tooth": {"beside": "-o s.csv"},
    "--translations": {"set": "train"},
    "--without": {"beside": f"{COARSE} --model coupled", "without": ELEMENTS},
    **{
        name: {"beside": f"{COARSE} --friction 0.2", "without": ELEMENTS}
        for name in ("--bending", "--sliding", "--torque-of")
    },
    "--transition-speed": {
        "beside": f"{COARSE} --friction 0.2 --sliding instantaneous",
        "without": ELEMENTS,
    },
}


class Case(NamedTuple):
    """A command, and the same with another value of an option.

    refused : whether the option is refused; set : name of the gear set
    """

    base: str
    changed: str
    set: str
    refused: bool


def option_name(param: Any) -> str:
    """`--torque` of an option, `SET` of an argument."""
    long_names = [name for name in param.opts if name.startswith("--")]
    return long_names[0] if long_names else param.metavar


def cases_of(command: str) -> Iterator[tuple[str, Case]]:
    """A case of each option of a command, by its name."""
    use, params = SHORT_USES[command], dict(commands())[command].params
    for param in params:
        name = option_name(param)
        case = _case_of(command, name, use.options.get(name, {}))
        if param.default is True:  # --no-corner-contact
            (opposite,) = param.secondary_opts
            case = case._replace(changed=case.changed.replace(name, opposite))
        yield name, case


def _case_of(command: str, name: str, declared: str | Mapping[str, Any]) -> Case:
    use = SHORT_USES[command]
    if isinstance(declared, str):
        declared = {"value": declared}
    needs = {**NEEDS.get(name, {}), **declared}
    base = words_of(f"{use.text} --json")
    for option in needs.get("without", "").split():
        base.pop(option, None)
    names = set(map(option_name, dict(commands())[command].params))
    base |= {
        option: value
        for option, value in words_of(needs.get("beside", "")).items()
        if option.isdigit() or option in names
    }
    changed = dict(base)
    for option in needs.get("instead", "").split():
        changed.pop(option, None)
    if name == "--json" or (name == "--resolution" and name in base):
        del base[name]
    elif not name.startswith("--"):
        changed["0"] = needs.get("value") or ARGUMENTS[base["0"]]
    elif "value" in needs:
        changed[name] = needs["value"]
    else:
        changed[name] = second_value(command, name)
    texts = (f"{command} {text_of(values)}" for values in (base, changed))
    return Case(*texts, needs.get("set", use.set), needs.get("refused", False))


def second_value(command: str, name: str) -> str:
    """A value that is not the default, nothing of a flag."""
    if name in SECOND_VALUES:
        return SECOND_VALUES[name]
    if name == "--resolution":
        return "coarse"
    study, key = load_study(command), name.removeprefix("--").replace("-", "_")
    if key == "output":
        return "there" if study.folder else f"other{study.endings[0]}"
    if key in study.pictures:
        return "other.png"
    if key in study.more_tables:
        return "other.csv"
    if key in study.more_files:
        return f"other{study.more_files[key][1][0]}"
    return FLAG


@cache
def settings_by_option(command: str) -> dict[str, ExposedField]:
    """Settings of a command that have an option, those of its groups too."""
    return {
        member.option: member
        for member in _members(group_of(load_study(command)))
        if not member.declared.place
    }


def _members(group: SettingsGroup) -> Iterator[Any]:
    for member in exposed_fields(group):
        if member.group is not None:
            yield from _members(member.group)
        elif isinstance(member.declared, Setting):
            yield member


def choices(kind: Any) -> list[Any]:
    """Words of a type."""
    if get_origin(kind) is Literal:
        return list(get_args(kind))
    return [choice for inner in get_args(kind) for choice in choices(inner)]
