"""Mesh stiffness of spur and helical gears by ISO 6336-1, clause 9, method B.

ISO 6336-1:2006 (equation numbers differ between editions, so clauses are cited).
The regression holds for steel on steel, external gears; `material_factor` takes it to
other materials. It counts the teeth and the
body near them, not the twist of a body on a small hub (see `ring`).

Unlike the rest of the package these functions keep the standard's N/(mm um),
except `mean_mesh_stiffness`. Check: teeth 17/43 give c'_th = 16.032, and with
C_M = 0.8, C_R = 1, C_B = 0.975 (dedendum 1.25 m) c' = 12.505 and, at contact ratio
1.6211, c_gamma = 18.330 N/(mm um). C_B = 1 belongs to a dedendum of 1.2 m.
"""

import math
from collections.abc import Iterator

SI_PER_ISO_UNIT = 1e9  # 1 N/(mm um) = 1e9 N/m per m of face width
STEEL = 206e9  # E_St [Pa], of the regression
CORRECTION = 0.8  # C_M, measured against theoretical stiffness, clause 9.3.1
STANDARD_DEDENDUM = 1.25  # h_fP / m of the ISO 53 profile A
SHIFT_SUMS = -0.5, 2.0  # x1 + x2 for which the series of q' holds, clause 9.3.1
MIN_CONTACT_RATIO = 1.2  # of c_gamma_alpha, clause 9.3.2
MISALIGNED = 0.85  # c_gamma_beta over c_gamma_alpha, clause 9.3.3
FULL_SPECIFIC_LOAD = 100e3  # Ft KA / b [N/m], below which c' falls, clause 9.3.1


def theoretical_single_stiffness(
    teeth: tuple[float, float], profile_shifts: tuple[float, float] = (0.0, 0.0)
) -> float:
    """c'_th = 1/q' [N/(mm um)], clause 9.3.1, the series for q'.

    teeth : z_n of pinion and wheel, for spur gears z
    profile_shifts : x1, x2; the standard asks x1 >= x2 and -0.5 <= x1 + x2 <= 2
    """
    if min(teeth) <= 0:
        raise ValueError(f"teeth = {teeth}; must be positive (external gears)")
    (z1, z2), (x1, x2) = teeth, profile_shifts
    q = 0.04723 + 0.15551 / z1 + 0.25791 / z2
    q += -0.00635 * x1 - 0.11654 * x1 / z1 - 0.00193 * x2 - 0.24188 * x2 / z2
    q += 0.00529 * x1**2 + 0.00182 * x2**2
    return 1.0 / q


def virtual_teeth(
    teeth: tuple[float, float], helix_angle: float, base_helix_angle: float
) -> tuple[float, float]:
    """z_n = z / (cos(beta_b)^2 cos(beta)) of pinion and wheel; angles in [rad]."""
    share = math.cos(base_helix_angle) ** 2 * math.cos(helix_angle)
    return teeth[0] / share, teeth[1] / share


def basic_rack_factor(
    dedendum: float = STANDARD_DEDENDUM, pressure_angle: float = math.radians(20.0)
) -> float:
    """C_B = (1 + 0.5 (1.2 - h_fP/m)) (1 - 0.02 (20 deg - alpha)), clause 9.3.1.

    dedendum : h_fP / m of the basic rack; pressure_angle : [rad]
    """
    angle_deg = math.degrees(pressure_angle)
    return (1.0 + 0.5 * (1.2 - dedendum)) * (1.0 - 0.02 * (20.0 - angle_deg))


def gear_blank_factor(web_ratio: float = 1.0, rim_in_modules: float = 1.0) -> float:
    """C_R = 1 + ln(bs/b) / (5 exp(sR / (5 m))), clause 9.3.1; 1 for a solid disc.

    web_ratio : bs/b, web over face width, held within 0.2 and 1.2 as prescribed
    rim_in_modules : sR/m, held at 1 or more as prescribed
    """
    ratio = min(max(web_ratio, 0.2), 1.2)
    rim = max(rim_in_modules, 1.0)
    return 1.0 + math.log(ratio) / (5.0 * math.exp(rim / 5.0))


def single_stiffness(
    theoretical: float,
    correction: float = CORRECTION,
    blank_factor: float = 1.0,
    rack_factor: float | None = None,
) -> float:
    """c' = c'_th C_M C_R C_B [N/(mm um)], clause 9.3.1; helical gears have cos(beta)
    of it.

    For a specific load of 100 N/mm or more; below, multiply by `low_load_factor`.
    rack_factor : C_B, None for the standard basic rack
    """
    C_B = basic_rack_factor() if rack_factor is None else rack_factor
    return theoretical * correction * blank_factor * C_B


def low_load_factor(specific_load: float) -> float:
    """((Ft KA / b) / (100 N/mm))^0.25 below 100 N/mm, else 1, clause 9.3.1.

    specific_load : Ft KA / b [N/m]
    """
    if not specific_load > 0.0:
        raise ValueError(f"specific_load = {specific_load}; must be positive")
    return math.sqrt(math.sqrt(min(specific_load / FULL_SPECIFIC_LOAD, 1.0)))


def material_factor(young_moduli: tuple[float, float]) -> float:
    """E / E_St with E = 2 E1 E2 / (E1 + E2), clause 9.3.1, of two gears [Pa].

    What deflects lies half in each gear: half the compliance scales with each modulus.
    """
    one, two = young_moduli
    if not min(one, two) > 0.0:
        raise ValueError(f"young_moduli = {young_moduli}; must be positive")
    return 2.0 * one * two / (one + two) / STEEL


def regression_limits(
    profile_shifts: tuple[float, float], contact_ratio: float
) -> Iterator[str]:
    """A line for each limit of clauses 9.3.1 and 9.3.2 that the teeth exceed.

    profile_shifts : x1, x2 of pinion and wheel
    """
    x1, x2 = profile_shifts
    if not x1 >= x2:
        yield f"the standard needs x1 >= x2, got {x1:g} and {x2:g}"
    if not SHIFT_SUMS[0] <= x1 + x2 <= SHIFT_SUMS[1]:
        low, high = SHIFT_SUMS
        yield f"the standard needs x1 + x2 from {low:g} to {high:g}, got {x1 + x2:g}"
    if not contact_ratio >= MIN_CONTACT_RATIO:
        yield (
            f"the standard needs a contact ratio of {MIN_CONTACT_RATIO:g} or more, "
            f"got {contact_ratio:.4g}"
        )


def mesh_stiffness(single: float, contact_ratio: float) -> float:
    """c_gamma_alpha = c' (0.75 eps_alpha + 0.25), clause 9.3.2, for eps_alpha >= 1.2.

    single : c' [N/(mm um)]; the result has its unit
    """
    if not contact_ratio >= 1.0:
        raise ValueError(f"contact_ratio = {contact_ratio}; must be at least 1")
    return single * (0.75 * contact_ratio + 0.25)


def face_load_factor(
    misalignment: float, mean_stiffness: float, specific_load: float
) -> float:
    """K_Hbeta of a mesh whose axes are misaligned, clause 7, method C.

    Load per width increases linearly over the width, from none at an end or inside of
    it where the misalignment is large.

    misalignment : F_beta_y, gap between the flanks over the width [m]
    mean_stiffness : c_gamma_alpha [N/(m m)], of which c_gamma_beta is 0.85
    specific_load : Fm / b [N/m]
    """
    if not specific_load > 0.0:
        raise ValueError(f"specific_load = {specific_load}; must be positive")
    half = 0.5 * abs(misalignment) * MISALIGNED * mean_stiffness / specific_load
    return 1.0 + half if half < 1.0 else 2.0 * math.sqrt(half)


def mean_mesh_stiffness(
    teeth: tuple[int, int],
    contact_ratio: float,
    face_width: float,
    profile_shifts: tuple[float, float] = (0.0, 0.0),
    factors: tuple[float, float, float] | None = None,
    helix: tuple[float, float] = (0.0, 0.0),
) -> float:
    """Mean mesh stiffness c_gamma_alpha b along the line of action [N/m].

    contact_ratio : in the section across the axis
    face_width : b [m]
    profile_shifts : in normal modules
    factors : (C_M, C_R, C_B), None for solid discs and the standard basic rack
    helix : angle on the reference and on the base cylinder [rad]
    """
    if not face_width > 0.0:
        raise ValueError(f"face_width = {face_width}; must be positive")
    one, two = virtual_teeth(teeth, *helix)
    theoretical = theoretical_single_stiffness((one, two), profile_shifts)
    single = single_stiffness(theoretical, *(factors or ())) * math.cos(helix[0])
    return mesh_stiffness(single, contact_ratio) * SI_PER_ISO_UNIT * face_width
