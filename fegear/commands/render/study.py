"""Pictures of gears in contact."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import MISSING, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from fegear.boundary import mesh_index
from fegear.figures.film import FILMS
from fegear.files.errors import InputError
from fegear.gearset.edit import parsed_value
from fegear.gearset.faults.checks import require_no_faults
from fegear.gearset.faults.tooth_faults import FAULT_KINDS
from fegear.gearset.leads import require_one_helix, require_uniform_loads
from fegear.gearset.model import GearSet
from fegear.rendering.contact_sequence import (
    ContactSequence,
    contact_at_rest,
    contact_in_motion,
    contacts_of_set,
)
from fegear.rendering.extremes import Peak, PeaksInView
from fegear.rendering.pictures import (
    DRAWN,
    PictureSettings,
    draw_contact,
    require_drawable_file,
)
from fegear.rendering.recorded import (
    HistoryFile,
    RecordedMotion,
    mesh_motion,
    read_history,
)
from fegear.rendering.width_contact import (
    WidthMoments,
    WidthPeak,
    WidthSequence,
    pair_number,
    width_contact_at_rest,
)
from fegear.rendering.width_pictures import draw_width_contact
from fegear.statics.settings import StaticsSettings
from fegear.studies.page import Page
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.settings import (
    Setting,
    SettingsGroup,
    display_name,
    expose,
    group,
    refusal,
    refuse_non_default,
    setting,
)
from fegear.studies.study import NO_PICTURES, Study
from fegear.studies.trains.gear_sets import (
    DEFAULT_PAIR,
    GearSetRef,
    mesh_setting,
)
from fegear.studies.trains.loads import chosen_torque
from fegear.studies.trains.shafts import require_shafts_used
from fegear.studies.trains.train_problem import refuse_edits


def _parsed_scale(text: str) -> float | None:
    """Drawn over true motion, None for auto."""
    if text == "auto":
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 <= value < 1e6:
        raise ValueError("must be auto, or 0 to below 1e6")
    return value


VARYING = "loads that vary over the face width"
ELEMENTS = SettingsGroup(
    kind=StaticsSettings,
    exposed=expose("friction", "plane", "resolution", "shafts"),
)
PICTURE = SettingsGroup(
    kind=PictureSettings,
    exposed=expose(
        *("shown", "motion_scale", "zoom", "width", "frames", "turns"),
        shown=Setting(option="--field"),
        motion_scale=Setting(option="--scale", parse=_parsed_scale),
    ),
)


@dataclass(frozen=True, kw_only=True)
class ContactPictures(
    Study,
    command="render",
    example="render liu-pair --position 0.5 --zoom tooth -o contact.png",
):
    """Pictures and films of the stress of gears in mesh.

    A zoom of set draws all gears with all meshes loaded at once, each at its own
    position in its cycle and under its part of the torque. --time-history draws the
    contact of a recorded motion: a film of its period, or the moment of its largest
    mesh force. Each moment shows the static fields under its own loads.

    Gears whose loads vary over the face width, helical, crowned or misaligned, are
    drawn in space with the contact pressure on the flanks of both.
    """

    pictures = NO_PICTURES
    output_names = ()

    file: str = setting(
        MISSING,
        "File to write. .png: a picture; .gif, .mp4: a film of the mesh cycle; .html: "
        "a page for browsers; .vtu: all fields for ParaView.",
        option="--output",
    )
    gear_set: GearSetRef = DEFAULT_PAIR
    mesh: int = mesh_setting()
    position: float | None = setting(
        None,
        "Mesh position [base pitches] from the pitch point, 0 to 1, or until the "
        "tooth pairs repeat where they have pitch errors; of a whole set that of mesh "
        "1. [default: 0]",
    )
    torque: float | None = setting(
        None,
        "Torque on the driving gear of the mesh, of a whole set on its input "
        "[N\u00a0m]. [default: middle load case of the gear set]",
    )
    time_history: str | None = setting(
        None,
        "Draw this recorded motion of the gear set, a file of `fegear dynamics "
        "--history`, by static fields under the loads of each moment.",
        metavar="FILE",
        reads=True,
    )
    elements: StaticsSettings = group(ELEMENTS)
    picture: PictureSettings = group(PICTURE)

    @property
    def gears(self) -> GearSet:
        """The gear set; InputError for an edit that changes nothing."""
        refuse_edits(self, {"torque": self.torque}, translations=False)
        gears = self.gear_set.healthy("pictures of contact")
        require_shafts_used(self.elements, gears, self.mesh, ELEMENTS)
        require_one_helix(gears, "pictures of contact")
        # pictures in the plane have no shafts unless they are asked for
        in_space = gears.meshes[mesh_index(gears, self.mesh)].varies_over_width
        if not in_space and self.elements.shafts == "off":
            reason = "changes nothing here; pictures in the plane have no shafts"
            raise refusal(self.elements, "shafts", reason, ELEMENTS)
        is_asked_for = in_space or self.elements.shafts == "on"
        return self.elements.on_shafts(gears) if is_asked_for else gears

    @property
    def named_files(self) -> list[str]:
        """Files that the gear set names with the changes of a recorded run."""
        if self.time_history is None:
            return []
        file = read_history(Path(self.time_history))
        return self.gear_set.files_with(_edits_of(file))

    def tasks(self) -> Iterator[Task]:
        self._require_file()
        is_root = self.picture.shown == "root-stress"
        if is_root and (self.picture.zoom == "set" or not self._varies_over_width):
            reason = f"needs one mesh with {VARYING}; von-mises shows other roots"
            raise refusal(self.picture, "shown", reason, PICTURE)
        if self.picture.zoom == "set":
            require_uniform_loads(self.gears, "pictures of a whole set")
            contact = self._set_without_place()
        elif self._varies_over_width:
            sequence = self._over_width()
            yield Task("picture", partial(self._draw_over_width, sequence))
            return
        else:
            contact = self._in_motion() if self.time_history else self._at_rest()
        yield Task("picture", partial(self._draw_contact, contact))

    def _require_file(self) -> None:
        """The file can be written, and is not asked for what it cannot show."""
        suffix = Path(self.file).suffix
        if suffix in FILMS and self.position is not None:
            reason = "a film shows all positions, leave it out"
            raise InputError(f"position = {self.position:g}; {reason}")
        require_drawable_file(Path(self.file))
        if suffix == ".vtu":
            reason = "a .vtu file holds all fields"
            refuse_non_default(self.picture, ("shown", "motion_scale"), reason, PICTURE)
        if suffix not in DRAWN:
            reason = f"a {suffix} file has no pixels"
            refuse_non_default(self.picture, ("width",), reason, PICTURE)
        if suffix not in FILMS:
            reason = "only films have frames, .gif and .mp4"
            refuse_non_default(self.picture, ("frames", "turns"), reason, PICTURE)
        if self.picture.zoom != "set":
            refuse_non_default(self.picture, ("turns",), "needs {zoom} set", PICTURE)

    def _set_without_place(self) -> ContactSequence:
        if self.mesh != 1:
            raise refusal(self, "mesh", "{zoom} set draws all meshes, leave it out")
        if self.time_history:
            reason = "{zoom} set draws gears at rest, leave one of them out"
            raise refusal(self, "time_history", reason)
        if self.torque == 0.0:
            raise refusal(self, "torque", "{zoom} set needs a load above 0")
        place = self.gears, chosen_torque(self.gears, self.torque), self.position or 0.0
        return contacts_of_set(*place, self.elements, self.picture.turns)

    @property
    def _varies_over_width(self) -> bool:
        """Whether the loads of the mesh that is drawn vary over the face width."""
        return self.gears.meshes[mesh_index(self.gears, self.mesh)].varies_over_width

    def _over_width(self) -> WidthSequence:
        """Contact over the face width; refuses what its pictures do not have."""
        if self.time_history:
            raise refusal(self, "time_history", f"{VARYING} are drawn at rest")
        shown = self.picture.shown
        if shown not in (None, "pressure", "root-stress"):
            reason = f"{VARYING} are drawn by their pressure or root-stress"
            raise refusal(self.picture, "shown", reason, PICTURE)
        suffix = Path(self.file).suffix
        with_root = shown == "root-stress" or suffix == ".vtu"
        if shown == "root-stress" and suffix == ".html":
            reason = "a page for browsers shows the pressure over the flank"
            raise refusal(self.picture, "shown", reason, PICTURE)
        reason = f"{VARYING} are drawn in space, leave it out"
        refuse_non_default(self.picture, ("zoom", "motion_scale"), reason, PICTURE)
        torque = chosen_torque(self.gears, self.torque, self.mesh)
        index = mesh_index(self.gears, self.mesh)
        place = self.gears, index, torque, self.position or 0.0
        return width_contact_at_rest(*place, self.elements, with_root)

    def _at_rest(self) -> ContactSequence:
        index = mesh_index(self.gears, self.mesh)
        torque = chosen_torque(self.gears, self.torque, self.mesh)
        place = self.gears, index, torque, self.position or 0.0
        return contact_at_rest(*place, self.elements)

    def _in_motion(self) -> ContactSequence:
        """Contact of a recorded motion, in the gear set with the changes of
        that run.
        """
        file = read_history(Path(self.time_history or ""))
        gears = self.gear_set.changed(_edits_of(file))
        require_no_faults(gears, FAULT_KINDS, "pictures of contact")
        index = mesh_index(gears, self.mesh)
        motion = mesh_motion(file, gears, index)
        self._require_same(motion)
        return contact_in_motion(gears, index, motion, self.elements)

    def _require_same(self, motion: RecordedMotion) -> None:
        """Settings given with a recorded motion may only repeat what its file says."""
        file, usual, elements = self.time_history, StaticsSettings(), self.elements
        if self.position is not None:
            reason = f"{file} has positions of its own, leave it out"
            raise InputError(f"position = {self.position:g}; {reason}")
        for name, value, default, recorded in (
            ("torque", self.torque, None, motion.torque),
            ("friction", elements.friction, usual.friction, motion.friction),
        ):
            same = math.isclose(value or 0.0, recorded, rel_tol=1e-6)
            if value != default and not same:
                raise InputError(f"{name} = {value:g}; {file} was run at {recorded:g}")
        if elements.plane not in (None, motion.plane):
            option = f"{display_name(self, 'plane')} {elements.plane}"
            raise InputError(f"{option}; {file} is of plane {motion.plane}")

    def _draw_contact(
        self, contact: ContactSequence, job: Job
    ) -> ContactPicturesResult:
        place = contact, Path(self.file), self.picture
        peaks = draw_contact(*place, job.report)
        return ContactPicturesResult(self, contact.title, peaks)

    def _draw_over_width(self, sequence: WidthSequence, job: Job) -> WidthPictureResult:
        moments = draw_width_contact(
            sequence, Path(self.file), self.picture, job.report
        )
        return WidthPictureResult(self, sequence.title, moments)


def _edits_of(file: HistoryFile) -> dict[str, Any]:
    """Changes of the gear set of a recorded run, by key."""
    return {key: parsed_value(value) for key, value in file.edits.items()}


@dataclass(frozen=True, eq=False)
class ContactPicturesResult(StudyResult):
    """What the file shows, which is written.

    title : of the contact; peaks : largest values of the picture, or of all frames
        of a film
    """

    study: ContactPictures
    title: str
    peaks: PeaksInView

    @property
    def summary(self) -> dict[str, Any]:
        """Largest stress of each gear and contact pressure in view, and their moments.

        Those of a film are the largest of all its frames. The pressure is that of
        pairs without a tip corner or a kink of a flank in contact, None
        where all have one.
        """
        peaks, pressure = self.peaks, self.peaks.pressure
        none = None if peaks.pairs else 0.0
        return {
            "contact": self.title,
            "output": self.study.file,
            "frames": peaks.fields,
            "plane_beside_contact": "strain",
            "largest_von_mises_MPa": {
                name: 1e-6 * peak.value for name, peak in peaks.stress.items()
            },
            "largest_von_mises_at": {
                name: _moment(peak) for name, peak in peaks.stress.items()
            },
            "largest_contact_pressure_MPa": (
                none if pressure is None else 1e-6 * pressure.value
            ),
            "largest_contact_pressure_at": (
                None if pressure is None else _moment(pressure)
            ),
            "pairs_with_edge_contact": peaks.edge_pairs,
        }

    def page(self) -> Page:
        peaks, pressure = self.peaks, self.peaks.pressure
        stress = ", ".join(
            f"{name} {self._value(peak)}" for name, peak in peaks.stress.items()
        )
        if pressure is not None:
            shown = self._value(pressure)
        else:
            shown = "none" if peaks.pairs else "0 MPa"
        yield self.title
        film = f" of {peaks.fields} frames" if peaks.fields > 1 else ""
        yield (
            f"largest von Mises stress in view{film}: {stress}; largest contact "
            f"pressure {shown}\nbeside a contact they are those of plane strain"
        )
        if peaks.edge_pairs:
            yield (
                "pressures of pairs with a tip corner or a kink, such as the start of "
                "a linear relief, in contact have no limit and are left out"
            )
        yield f"wrote {self.study.file}"

    def _value(self, peak: Peak) -> str:
        """Value of a peak in MPa, and its moment where there are several."""
        at = f" at {peak.moment}" if self.peaks.fields > 1 else ""
        return f"{1e-6 * peak.value:.0f} MPa{at}"


def _moment(peak: Peak) -> dict[str, float]:
    """Position [base pitches] and, in a motion, the time of a peak."""
    at = {"position": peak.position}
    return at if peak.time is None else at | {"time_s": peak.time}


@dataclass(frozen=True, eq=False)
class WidthPictureResult(StudyResult):
    """What the file of a mesh whose loads vary over the face width shows.

    title : of the contact; moments : that are drawn
    """

    study: ContactPictures
    title: str
    moments: WidthMoments

    @property
    def summary(self) -> dict[str, Any]:
        """Largest contact pressure, and its tooth pair, place and position.

        Of a film the largest of all its frames; of slices at which flanks touch, None
        where only edges do.
        """
        peak = self.moments.peak
        return {
            "contact": self.title,
            "output": self.study.file,
            "frames": len(self.moments),
            "largest_contact_pressure_MPa": None if peak is None else 1e-6 * peak.value,
            "largest_contact_pressure_at": None if peak is None else _place(peak),
            "slices_with_edge_contact": self.moments.edge_slices,
            **self._root_figures,
        }

    @property
    def _root_figures(self) -> dict[str, Any]:
        """Largest root stress of both gears, nothing where it is not drawn."""
        names = (gear.name for gear in self.moments.gears)
        values = [1e-6 * peak for peak in self.moments.root_peaks]
        if not values:
            return {}
        return {"largest_root_stress_MPa": dict(zip(names, values, strict=True))}

    def page(self) -> Page:
        peak, count = self.moments.peak, len(self.moments)
        film = f" of {count} frames" if count > 1 else ""
        yield self.title
        yield f"largest contact pressure{film}: {_peak_text(peak)}"
        for largest in self._root_figures.values():
            for name, value in largest.items():
                yield f"largest root stress of {name}: {value:.4g} MPa"
        if self.moments.edge_slices:
            yield (
                "pressures of edges, off the path of contact or near its ends, have no "
                "limit and are left out"
            )
        yield f"wrote {self.study.file}"


def _place(peak: WidthPeak) -> dict[str, float]:
    return {
        "position": peak.position,
        "pair": peak.pair,
        "place_over_width_mm": 1e3 * peak.place,
    }


def _peak_text(peak: WidthPeak | None) -> str:
    if peak is None:
        return "none, only edges touch"
    end = "far" if peak.place > 0.0 else "near"
    return (
        f"{1e-6 * peak.value:.0f} MPa at position {peak.position:.3f}, tooth pair "
        f"{pair_number(peak.pair)}, {1e3 * abs(peak.place):.2f} mm from the middle of "
        f"the width toward the {end} end"
    )
