"""Largest stress and pressure of a picture, or of all frames of a film."""

from __future__ import annotations

from dataclasses import dataclass, field

from fegear.rendering.fields import ContactField


@dataclass(frozen=True)
class Peak:
    """A largest value [Pa] and the moment at which it occurs.

    position : base pitches from the pitch point, in a motion from the start of the
        mesh's cycle
    time : in a motion, since the start of its record [s]
    """

    value: float
    position: float
    time: float | None = None

    @property
    def moment(self) -> str:
        at = f"position {self.position:.3f}"
        return at if self.time is None else f"{at}, {1e3 * self.time:.4g} ms"


@dataclass
class PeaksInView:
    """Peaks of the fields that were added one after another; these are not stored.

    stress : von Mises stress, by the name of the gear
    pressure : contact pressure of pairs without a tip corner or the start of a linear
        relief in contact, None without such pairs
    fields, pairs, edge_pairs : number of fields, of loaded pairs, and of pairs left out
    """

    stress: dict[str, Peak] = field(default_factory=dict)
    pressure: Peak | None = None
    fields: int = 0
    pairs: int = 0
    edge_pairs: int = 0

    def add(self, shown: ContactField) -> None:
        time = None if shown.instant is None else shown.instant.time

        def higher(old: Peak | None, value: float) -> Peak:
            if old is None or value > old.value:
                return Peak(value, shown.position, time)
            return old

        for gear in shown.gears:
            largest = float(gear.von_mises.max())
            self.stress[gear.name] = higher(self.stress.get(gear.name), largest)
        for pair in shown.pairs:
            if not pair.has_edge:
                self.pressure = higher(self.pressure, float(pair.pressure.max()))
        self.fields += 1
        self.pairs += len(shown.pairs)
        self.edge_pairs += sum(pair.has_edge for pair in shown.pairs)
