"""A planetary set as a machine (Lin and Parker 1999).

Coordinates: x, y and u = r theta of carrier, ring and sun in a fixed frame; radial, tangential and
rotational displacement of each planet. All in um. Gyroscopic terms are left out.
"""

import math
from collections.abc import Collection, Mapping

import numpy as np

from gearchaos.models.train.assembly import Assembly
from gearchaos.models.train.geometry import given_ratios
from gearchaos.models.train.tables import MEMBERS, MeshStiffness, Planetary
from gearchaos.models.train.waves import error_waves, orders_of, stiffness_waves


def mesh_rate(given: Planetary) -> float:
    """Return the mesh periods per revolution of the input member."""
    return abs(given.sun_teeth * _turns_of_sun(given))


def _turns_of_sun(given: Planetary) -> float:
    """Return the turns of the sun against the carrier per turn of the input member."""
    sun, ring = given.sun_teeth, given.ring_teeth
    # Speeds of sun, ring and carrier: sun n_s + ring n_r = (sun + ring) n_c (Willis).
    speeds = dict.fromkeys(MEMBERS, 0.0) | {given.input: 1.0}
    third = next(name for name in MEMBERS if name not in (given.input, given.fixed))
    weights = {"sun": sun, "ring": ring, "carrier": -(sun + ring)}
    speeds[third] = -sum(weights[name] * speeds[name] for name in speeds) / weights[third]
    return speeds["sun"] - speeds["carrier"]


def torques(given: Planetary) -> dict[str, float]:
    """Return the torques on sun, ring and carrier in N m, which are in equilibrium.

    They are in the ratio of the teeth: sun : ring : carrier = z_s : z_r : -(z_s + z_r).
    """
    parts = {
        "sun": given.sun_teeth,
        "ring": given.ring_teeth,
        "carrier": -(given.sun_teeth + given.ring_teeth),
    }
    return {name: given.torque_Nm * part / parts[given.input] for name, part in parts.items()}


def radii(given: Planetary) -> dict[str, float]:
    """Return the radius in mm at which the rotation of each member is measured.

    These are the base radii, and for the carrier the radius of the centres of the planets.
    """
    per_tooth = given.sun_base_radius_mm / given.sun_teeth
    # Half of the sum of both base radii, as the equilibrium of a planet requires.
    centre = per_tooth * (given.sun_teeth + given.ring_teeth) / 2.0
    return {
        "sun": given.sun_base_radius_mm,
        "ring": per_tooth * given.ring_teeth,
        "carrier": centre / math.cos(math.radians(given.pressure_angle_deg)),
    }


def force_of_torque(given: Planetary, member: str) -> float:
    """Return the force in N along the rotation of a member by a torque of 1 N m on it."""
    return 1e3 / radii(given)[member]


def assembled(given: Planetary, effects: Collection[str], *, free: bool = False) -> Assembly:
    """Return the parts of a planetary set.

    ``free``: whether all members can rotate, also the input and the fixed one.
    """
    parts = Assembly(orders_of([(given.sun_mesh, 1), (given.ring_mesh, 1)]))
    translates = "translation" in effects
    _add_members(parts, given, translates, free)
    for number in range(given.planets):
        _add_planet(parts, given, number, translates)
    for number in range(given.planets):
        rows = mesh_rows(given, number)
        for (name, row), phase in zip(rows.items(), mesh_phases(given, number), strict=True):
            mesh = given.sun_mesh if name.startswith("sun") else given.ring_mesh
            _add_mesh(parts, name, row, mesh, phase, effects)
    return parts


def _add_members(parts: Assembly, given: Planetary, translates: bool, free: bool) -> None:
    """Add carrier, ring and sun."""
    torque, radius = torques(given), radii(given)
    for name in ("carrier", "ring", "sun"):
        member = getattr(given, name)
        bearing = member.bearing_N_per_um
        damping = 2.0 * given.damping_ratio * math.sqrt(bearing * member.mass_kg)
        for axis in "xy" if translates else "":
            parts.coordinate(f"{name}_{axis}", member.mass_kg)
            parts.spring({f"{name}_{axis}": 1.0}, bearing, damping)
        held = member.rotation_N_per_um
        rotates = name == given.loaded or (name == given.fixed and held > 0.0)
        if rotates or free:
            # 1 N m at 1 mm are 1000 N.
            force = 1e3 * torque[name] / radius[name] if name == given.loaded else 0.0
            parts.coordinate(f"{name}_u", member.inertia_kg, force)
            damping = 2.0 * given.damping_ratio * math.sqrt(held * member.inertia_kg)
            if held > 0.0:
                parts.spring({f"{name}_u": 1.0}, held, damping)


def _add_planet(parts: Assembly, given: Planetary, number: int, translates: bool) -> None:
    """Add a planet with its bearing on the carrier."""
    one, angle = f"planet_{number + 1}", 2.0 * math.pi * number / given.planets
    planet = given.planet
    damping = 2.0 * given.damping_ratio * math.sqrt(planet.bearing_N_per_um * planet.mass_kg)
    across, along = math.cos(angle), math.sin(angle)
    if translates:
        parts.coordinate(f"{one}_radial", planet.mass_kg)
    parts.coordinate(f"{one}_tangential", planet.mass_kg)
    parts.coordinate(f"{one}_u", planet.inertia_kg)
    radial = {"carrier_x": across, "carrier_y": along, f"{one}_radial": -1.0}
    tangential = {"carrier_x": -along, "carrier_y": across, "carrier_u": 1.0}
    if translates:
        parts.spring(radial, planet.bearing_N_per_um, damping)
    row = {**tangential, f"{one}_tangential": -1.0}
    parts.spring(row, planet.bearing_N_per_um, damping)


def mesh_rows(given: Planetary, number: int) -> dict[str, dict[str, float]]:
    """Return the rows of the meshes of a planet with sun and ring, by the names of the meshes.

    The line of action is that of the flanks which carry the load: their force parts the gears.
    """
    one, angle = f"planet_{number + 1}", 2.0 * math.pi * number / given.planets
    alpha = math.radians(given.pressure_angle_deg)
    if torques(given)["sun"] < 0.0:
        alpha = -alpha
    sine, cosine = math.sin(alpha), math.cos(alpha)
    rows = {}
    for gear, side in (("sun", -1.0), ("ring", 1.0)):
        line = angle + side * alpha
        rows[f"{gear}_{one}"] = {
            f"{gear}_x": -math.sin(line),
            f"{gear}_y": math.cos(line),
            f"{gear}_u": 1.0,
            f"{one}_radial": side * sine,
            f"{one}_tangential": -cosine,
            f"{one}_u": -side,
        }
    return rows


def mesh_phases(given: Planetary, number: int) -> tuple[float, float]:
    """Return the phases of the meshes of a planet with sun and ring, in mesh periods.

    They are those of Parker and Lin (2004). The planets are numbered in the direction in which
    rotations are positive. If the sun turns this way, seen from the carrier, its teeth reach a
    later planet later, by the teeth within the angle between both; the ring turns the other way,
    and its teeth reach it earlier. The input member turns in the direction of its torque. Where
    the planet has an even number of teeth, its meshes with sun and ring are half a period apart.
    """
    onward = _turns_of_sun(given) * (-1.0 if given.torque_Nm < 0.0 else 1.0) > 0.0
    share = number / given.planets * (1.0 if onward else -1.0)
    apart = 0.5 if given.planet_teeth % 2 == 0 else 0.0
    return (-given.sun_teeth * share) % 1.0, (apart + given.ring_teeth * share) % 1.0


def _add_mesh(
    parts: Assembly,
    name: str,
    row: Mapping[str, float],
    mesh: MeshStiffness,
    phase: float,
    effects: Collection[str],
) -> None:
    """Add a mesh as a clearance element."""
    orders = parts.orders
    ratios = given_ratios(mesh) if "stiffness_variation" in effects else None
    stiffness = stiffness_waves(mesh, 1, orders, ratios, phase)
    error = error_waves(mesh, 1, orders, phase)
    if "transmission_error" not in effects:
        error = np.zeros_like(error)
    inertia = parts.inertia_along(row)
    damping = 2.0 * mesh.damping_ratio * math.sqrt(mesh.mean_stiffness * inertia)
    backlash = mesh.half_backlash_um if "backlash" in effects else 0.0
    in_contact = mesh.damping_acts == "in_contact" and "backlash" in effects
    parts.element(name, row, (stiffness, error), damping, backlash, in_contact)
