"""Base radii and contact ratios of the gears of a train, from their modules (DIN 3960)."""

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from gearchaos.configuration.messages import Fault
from gearchaos.models.gear_pair.geometry import HelicalPair
from gearchaos.models.gear_pair.geometry_faults import geometry_faults
from gearchaos.models.train.tables import Gear, Mesh, MeshStiffness

DEFAULT_RATIO = 1.6
"""Contact ratio of a mesh without other data."""

SAME_PITCH = 0.01
"""Largest relative difference of the base pitches of two gears in mesh."""

_ALIKE = ("normal_module_mm", "normal_pressure_angle_deg", "helix_angle_deg")
"""Keys in which gears in mesh agree."""

RADIUS = "base_radius_mm"


class ContactRatios(NamedTuple):
    """Transverse contact ratio and overlap ratio of a mesh."""

    transverse: float
    overlap: float = 0.0


def completed(gears: Mapping[str, Gear], meshes: Mapping[str, Mesh]) -> dict[str, Gear]:
    """Return gears; those without a size take module, angles and width of their mates."""
    found = dict(gears)
    for _ in gears:
        for mesh in meshes.values():
            for name, mate in (mesh.gears, mesh.gears[::-1]):
                if name in found and mate in found and _has_no_size(found[name]):
                    found[name] = _like(found[name], found[mate])
    return found


def _has_no_size(gear: Gear) -> bool:
    return gear.base_radius_mm is None and gear.normal_module_mm is None


def _like(gear: Gear, mate: Gear) -> Gear:
    """Return a gear with the tooth data of another one."""
    shared = {name: getattr(mate, name) for name in _ALIKE}
    if gear.face_width_mm is None:
        shared["face_width_mm"] = mate.face_width_mm
    return gear.model_copy(update=shared)


def given_ratios(mesh: MeshStiffness) -> ContactRatios:
    """Return the contact ratios of a mesh of spur gears."""
    return ContactRatios(DEFAULT_RATIO if mesh.contact_ratio is None else mesh.contact_ratio)


def base_radius_mm(gear: Gear) -> float:
    """Return the base radius: as given, or m_n z cos(alpha_t) / (2 cos(beta))."""
    if gear.base_radius_mm is not None:
        return gear.base_radius_mm
    helix = math.radians(gear.helix_angle_deg)
    normal = math.radians(gear.normal_pressure_angle_deg)
    transverse = math.atan(math.tan(normal) / math.cos(helix))
    radius = (gear.normal_module_mm or 0.0) * gear.teeth / (2.0 * math.cos(helix))
    return radius * math.cos(transverse)


def pair_of(mesh: Mesh, gears: Mapping[str, Gear]) -> HelicalPair | None:
    """Return two gears in mesh as a pair, with lengths in m; None without their modules."""
    one, other = (gears[name] for name in mesh.gears)
    if one.normal_module_mm is None or other.normal_module_mm is None:
        return None
    widths = [gear.face_width_mm for gear in (one, other) if gear.face_width_mm is not None]
    tips = one.tip_diameter_mm, other.tip_diameter_mm
    shifts = one.profile_shift, other.profile_shift
    return HelicalPair(
        teeth=(one.teeth, other.teeth),
        normal_module=1e-3 * one.normal_module_mm,
        normal_pressure_angle=math.radians(one.normal_pressure_angle_deg),
        helix_angle=math.radians(one.helix_angle_deg),
        face_width=1e-3 * min(widths, default=0.0),
        density=1.0,
        profile_shift=shifts if any(shifts) else None,
        centre_distance=_in_metres(mesh.centre_distance_mm),
        tip_diameters=(
            None if tips[0] is None or tips[1] is None else (1e-3 * tips[0], 1e-3 * tips[1])
        ),
        contact_ratio=mesh.contact_ratio,
    )


def contact_ratios(mesh: Mesh, gears: Mapping[str, Gear]) -> ContactRatios:
    """Return the contact ratios of a mesh: as given, of its gears, or by default."""
    pair = pair_of(mesh, gears)
    if pair is None:
        return given_ratios(mesh)
    return ContactRatios(float(pair.transverse_contact_ratio), float(pair.overlap_contact_ratio))


def faults_of_gear(path: str, gear: Gear) -> Iterator[Fault]:
    """Yield what is wrong with the size of a gear."""
    if _has_no_size(gear):
        remedy = "give it, or normal_module_mm of this gear or of one that it meshes with"
        yield Fault(f"{path}.base_radius_mm", "is missing", remedy)
    elif gear.base_radius_mm is not None and gear.normal_module_mm is not None:
        rule = "is given beside normal_module_mm, from which it follows"
        yield Fault(f"{path}.base_radius_mm", rule, "keep one of the two", gear.base_radius_mm)


def faults_of_mesh(path: str, mesh: Mesh, gears: Mapping[str, Gear]) -> Iterator[Fault]:
    """Yield what is wrong with the geometry of two gears whose sizes are known."""
    names, (one, other) = mesh.gears, (gears[name] for name in mesh.gears)
    pair = pair_of(mesh, gears)
    if pair is None:
        if mesh.centre_distance_mm is not None:
            rule, remedy = "needs the modules of both gears", "give normal_module_mm of the gears"
            yield Fault(f"{path}.centre_distance_mm", rule, remedy, mesh.centre_distance_mm)
        pitches = [base_radius_mm(gear) / gear.teeth for gear in (one, other)]
        if abs(pitches[1] / pitches[0] - 1.0) > SAME_PITCH:
            first, second = (f"{2.0 * math.pi * pitch:.5g} mm" for pitch in pitches)
            rule = f"{names[0]} has the base pitch {first} and {names[1]} {second}, must be equal"
            yield Fault(f"{path}.gears", rule, "check teeth and base radii", list(names))
        return
    for key in _ALIKE:
        if getattr(one, key) != getattr(other, key):
            rule = f"must equal that of {names[0]}, {getattr(one, key):g}, with which it meshes"
            where = f"gear.{names[1]}.{key}"
            yield Fault(where, rule, "correct one of the two", getattr(other, key))
            return
    tips = [gear.tip_diameter_mm is not None for gear in (one, other)]
    if any(tips) and not all(tips):
        rule = f"is missing, and the tip diameter of {names[tips.index(True)]} is given"
        where = f"gear.{names[tips.index(False)]}.tip_diameter_mm"
        yield Fault(where, rule, "give both tip diameters, or none")
        return
    paths = {
        "centre_distance": f"{path}.centre_distance_mm",
        "contact_ratio": f"{path}.contact_ratio",
        "tip_diameters": f"gear.{names[0]}.tip_diameter_mm",
    }
    with np.errstate(all="ignore"):
        yield from geometry_faults(pair, paths)


def fault_of_sweep(path: str, gears: Mapping[str, Gear], meshes: Mapping[str, Mesh]) -> str:
    """Return the gear whose own tooth data contradict a sweep of those of its mate, if any.

    The mate of a gear with a base radius has one, too, and both have the same base pitch.
    """
    table, _, key = path.rpartition(".")
    name = table.removeprefix("gear.")
    if key not in (*_ALIKE, RADIUS) or name not in gears:
        return ""
    mates = {mate for mesh in meshes.values() if name in mesh.gears for mate in mesh.gears} - {name}
    own = [mate for mate in sorted(mates) if key == RADIUS or not _has_no_size(gears[mate])]
    return own[0] if own else ""


def _in_metres(millimetres: float | None) -> float | None:
    return None if millimetres is None else 1e-3 * millimetres
