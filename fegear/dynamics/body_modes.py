"""Elastic modes of the gears' bodies as coordinates of the coupled model.

Modes with nodal diameters are seen in a frame that does not turn with the gear: there
the contacts stay in one place, and their penetration per coordinate repeats with the
mesh cycle. See `lumped.train.coupled.BodyModes`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fegear.dynamics.build import SPEED_BAND_FACTORS
from fegear.dynamics.elastic import ElasticGear
from fegear.dynamics.gear_elasticity import elastic_damping
from fegear.dynamics.kernels.step_arrays import ContactJacobian, ModalMatrices
from fegear.dynamics.mesh_load_curves import pitch_point
from fegear.dynamics.model import modal_matrices
from fegear.dynamics.rows import contact_rows
from fegear.dynamics.sides import DRIVE, ContactSide
from fegear.elasticity.cache import cached_arrays
from fegear.elasticity.gear_modes import GearModes, lowest_modes, static_inertia
from fegear.elasticity.sector import CyclicSector
from fegear.gearset.model import Gear, GearSet
from fegear.statics.settings import StaticsSettings
from lumped.common.array_types import Array, Indices
from lumped.common.checks import require_present
from lumped.train.coupled import BodyModes, CoupledContacts, LoadedState
from lumped.train.elastic_inertia import harmonic_amplitudes
from lumped.train.modes import MIN_RESONANCE_ENERGY
from lumped.train.system import LumpedSystem
from lumped.train.truncation import TruncationModel

# families with fewer nodal diameters are solved, at least and at most
FAMILY_LIMITS = 6, 12
MODES_PER_FAMILY = 3  # the lowest modes of each
# times the highest resonance: families that begin there are not solved
CUTOFF_FACTOR = 4.0
DAMPING = 0.01  # ratio where a gear's first elastic modes are, less above
cached_lowest_modes = lru_cache(maxsize=16)(
    lowest_modes
)  # equal gears, and all torques


@lru_cache(maxsize=64)
def cached_static_inertia(sector: CyclicSector, density: float, arc: float) -> float:
    """`static_inertia`, read from disk where it was computed before."""
    inputs = {"density": density, "arc": arc}
    arrays = cached_arrays(
        *("static-inertia", sector, inputs),
        lambda: {"inertia": np.array(static_inertia(sector, density, arc))},
    )
    return float(arrays["inertia"])


def lowest_modes_of_gears(
    gear_set: GearSet, settings: StaticsSettings, reference: LumpedSystem
) -> list[GearModes]:
    """The lowest modes of every gear, by families of nodal diameters.

    reference : the lumped system (Model-1), whose resonances harmonics excite
    """
    highest = CUTOFF_FACTOR * float(reference.modes.mesh_resonances_Hz.max(initial=0.0))
    return [
        cached_lowest_modes(
            *(settings.sector(gear), gear.density),
            *(
                range(min(FAMILY_LIMITS[0], _max_nodal_diameters(gear))),
                MODES_PER_FAMILY,
            ),
            *(min(FAMILY_LIMITS[1], _max_nodal_diameters(gear)), highest),
        )
        for gear in gear_set.gears
    ]


def _max_nodal_diameters(gear: Gear) -> int:
    """Number of nodal diameters below half the number of teeth."""
    return (gear.geometry.teeth + 1) // 2


def static_inertias(
    gear_set: GearSet, sides: Sequence[ContactSide], settings: StaticsSettings
) -> Array:
    """Sum (m,) of w^2 / omega^4 over all modes of both gears of each mesh [s2 m/N].

    w : penetration at the pitch point per coordinate of unit mass
    """
    inertias = np.zeros(len(gear_set.meshes))
    for side in sides:
        if side.flank_sign != DRIVE:
            continue
        pair, position_index = pitch_point(
            gear_set, side.mesh, len(side.load_curves.gap) - 1
        )
        contact = int(np.flatnonzero(side.load_curves.pair_offsets == pair)[0])
        for g in side.gears:
            gear = gear_set.gears[g]
            sector_and_density = settings.sector(gear), gear.density
            arc = float(side.arcs(g)[position_index, contact])
            inertias[side.mesh] += (
                cached_static_inertia(*sector_and_density, arc) / gear.toothed_width
            )
    return inertias


def body_modes(
    gear_set: GearSet,
    reference: LumpedSystem,
    sides: Sequence[ContactSide],
    modes: Sequence[GearModes],
) -> BodyModes:
    """Body modes of `fegear.dynamics.model`, in a frame that does not turn with the
    gears.

    modes : of each gear
    """
    elastic = [
        ElasticGear(gear_modes, gear.toothed_width, elastic_damping(gear, DAMPING))
        for gear, gear_modes in zip(gear_set.gears, modes, strict=True)
    ]
    modal = modal_matrices(gear_set, reference, elastic)
    jacobian = contact_rows(gear_set, reference, sides, elastic, 0.0)
    is_travelling, n_modes = (
        modal.partner != np.arange(modal.gear_of_mode.size),
        modal.gear_of_mode.size,
    )
    is_first_of_pair = is_travelling & (modal.partner > np.arange(n_modes))
    mode_order = np.argsort(
        is_travelling.astype(int) + (is_travelling & ~is_first_of_pair), kind="stable"
    )
    phase_per_tooth = np.arctan2(modal.sine, modal.cosine) * np.where(
        is_first_of_pair, 1.0, -1.0
    )
    phase_per_tooth = np.where(
        is_travelling, phase_per_tooth, 0.0
    )  # of a mode by the pitch of a tooth
    rate = _mesh_rates(gear_set, reference)[modal.gear_of_mode]
    rows = _rows_in_fixed_frame(
        _mode_rows(jacobian, modal), modal.partner, is_first_of_pair, phase_per_tooth
    )
    coupling = (modal.coupling[:, None] * modal.rotation[modal.gear_of_mode])[
        mode_order
    ]
    unstrained_coupling = np.delete(coupling, reference.moving, axis=1)
    return BodyModes(
        angular=np.sqrt(modal.rigidity)[mode_order],
        damping=modal.elastic_damping[mode_order],
        coupling=coupling[:, reference.moving],
        # hubs that no mesh strains follow freely: z'' = -G'e''
        mass=np.eye(n_modes) - unstrained_coupling @ unstrained_coupling.T,
        rows=np.ascontiguousarray(rows[..., mode_order]),
        whirl=(phase_per_tooth / (2.0 * np.pi) * rate)[mode_order],
        gears=modal.gear_of_mode[mode_order],
        nodal_diameters=np.concatenate([m.nodal_diameters for m in modes])[mode_order],
    )


def _mesh_rates(gear_set: GearSet, reference: LumpedSystem) -> Array:
    """Cycles (gears,) of a mesh of each gear per cycle of the first mesh."""
    rates = [float(rate) for rate in reference.train.mesh_rates]
    gear_rates = np.zeros(len(gear_set.gears))  # 0 of gears without mesh
    for mesh, rate in zip(gear_set.meshes, rates, strict=True):
        gear_rates[[mesh.driver, mesh.driven]] = rate
    return gear_rates


def _mode_rows(jacobian: ContactJacobian, modal: ModalMatrices) -> Array:
    """Penetration (c, p + 1, b) of all contacts per coordinate of the modes."""
    hubs = modal.damping.size
    rows = np.zeros((*jacobian.normal.shape[:2], modal.rigidity.size))
    for c, m in enumerate(jacobian.mesh_of):
        elastic_columns = slice(hubs, jacobian.widths[m])
        rows[c][:, jacobian.columns[m, elastic_columns] - hubs] = jacobian.normal[
            c, :, elastic_columns
        ]
    return rows


def _rows_in_fixed_frame(
    rows: Array,
    partner: Indices,
    is_first_of_pair: NDArray[np.bool_],
    phase_per_tooth: Array,
) -> Array:
    """Rows in the non-rotating frame, from rows in the frame of a gear.

    phase_per_tooth : (b,) angle of each pair by which the gear's coordinates E1 - i E2
        fall behind in a mesh cycle
    """
    first_modes, partner_modes = (
        np.flatnonzero(is_first_of_pair),
        partner[is_first_of_pair],
    )
    cycle = np.linspace(0.0, 1.0, rows.shape[1])[:, None]
    fixed_pair = (rows[..., first_modes] + 1j * rows[..., partner_modes]) * np.exp(
        -1j * phase_per_tooth[first_modes] * cycle
    )
    fixed_rows = rows.copy()
    fixed_rows[..., first_modes], fixed_rows[..., partner_modes] = (
        fixed_pair.real,
        fixed_pair.imag,
    )
    return fixed_rows


def with_body_modes(
    gear_set: GearSet,
    contacts: CoupledContacts,
    reference: LumpedSystem,
    modes: BodyModes,
    mesh_inertias: Array,
    is_retained: NDArray[np.bool_] | None = None,
) -> CoupledContacts:
    """Contacts with those body modes as coordinates that matter at the speeds of the
    train's own resonances.

    So the motion at one speed does not depend on which others are asked for.

    is_retained : mask of those modes, where it is known
    reference : Model-1 of the same train; modes : all that were solved
    mesh_inertias : (m,) of the meshes' static displacement, see `static_inertias`
    """
    without_modes = replace(reference, contacts=replace(contacts, modes=None))
    loaded_state = require_present(without_modes.loaded, "loaded state")
    truncation_model = _truncation_model(
        gear_set, contacts, reference, modes, mesh_inertias, loaded_state
    )
    if is_retained is None or is_retained.size != modes.count:
        with_all_modes = replace(reference, contacts=replace(contacts, modes=modes))
        is_retained = truncation_model.choose(loaded_resonance_band(with_all_modes))
    return replace(
        contacts,
        modes=modes.select(is_retained),
        solved_modes=modes,
        truncation_model=truncation_model,
        retained=is_retained,
    )


def loaded_resonance_band(system: LumpedSystem) -> tuple[float, float]:
    """Mesh frequencies of the first mesh [Hz] around a train's resonances.

    From a tenth of the lowest natural frequency of the coupled model with its body
    modes that strains the meshes to 1.3 times the highest that strains them much.
    """
    loaded_state = system.loaded
    if loaded_state is None:
        raise ValueError("the system must have contacts of the coupled model")
    straining_Hz = loaded_state.frequency_Hz[
        loaded_state.mesh_energy.sum(axis=0) >= MIN_RESONANCE_ENERGY
    ]
    rates = [float(rate) for rate in system.train.mesh_rates]
    low = SPEED_BAND_FACTORS[0] * float(straining_Hz.min()) / max(rates)
    high = (
        SPEED_BAND_FACTORS[1]
        * system.highest_mesh_mode_angular
        / (2.0 * np.pi)
        / min(rates)
    )
    return low, max(high, low)


def _truncation_model(
    gear_set: GearSet,
    contacts: CoupledContacts,
    reference: LumpedSystem,
    modes: BodyModes,
    mesh_inertias: Array,
    loaded_state: LoadedState,
) -> TruncationModel:
    """Shares of the modes are those at the pitch point, in the mean stiffness."""
    families = np.arange(modes.count)
    first_of_pair, second_of_pair = np.split(families[modes.nodal_diameters > 0], 2)
    families[second_of_pair] = first_of_pair
    is_drive_side, positions = contacts.contacts.side > 0, modes.rows.shape[1] - 1
    rows_at_pitch_point = np.empty((len(reference.excitations), modes.count))
    for m in range(len(rows_at_pitch_point)):
        pair, position_index = pitch_point(gear_set, m, positions)
        is_pitch_pair = (
            (contacts.mesh_of == m) & (contacts.pairs == pair) & is_drive_side
        )
        rows_at_pitch_point[m] = modes.rows[
            np.flatnonzero(is_pitch_pair)[0], position_index
        ]
    stiffness = reference.modes.mean_stiffness[:, None]
    ste = loaded_state.deflection[:-1].T
    squared_rows = rows_at_pitch_point**2
    residual_inertia = mesh_inertias - (squared_rows / modes.angular**4).sum(axis=1)
    unsolved_Hz = _unsolved_Hz(modes)
    return TruncationModel(
        frequencies_Hz=modes.angular / (2.0 * np.pi),
        damping_ratio=0.5 * modes.damping / modes.angular,
        families=families,
        compliance=stiffness * squared_rows / modes.angular**2,
        unsolved_Hz=unsolved_Hz,
        unsolved_compliance=stiffness[:, 0]
        * np.maximum(residual_inertia, 0.0)
        * (2.0 * np.pi * unsolved_Hz) ** 2,
        amplitudes=np.stack([harmonic_amplitudes(mesh_ste) for mesh_ste in ste]),
        rate=np.array([float(rate) for rate in reference.train.mesh_rates]),
        resonances_Hz=loaded_state.frequency_Hz,
        energy=loaded_state.mesh_energy,
        resonance_damping=reference.train.damping_ratio,
    )


def _unsolved_Hz(modes: BodyModes) -> float:
    """Lower bound of the natural frequencies that were not solved [Hz].

    It is the lowest of the last family's lowest and of each family's highest.
    """
    bounds = []
    for gear in np.unique(modes.gears):
        is_of_gear, n = modes.gears == gear, modes.nodal_diameters
        is_last_family = is_of_gear & (n == n[is_of_gear].max())
        bounds.append(modes.angular[is_last_family].min())
        bounds += [
            modes.angular[is_of_gear & (n == k)].max() for k in np.unique(n[is_of_gear])
        ]
    return float(min(bounds)) / (2.0 * np.pi)
