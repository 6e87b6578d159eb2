"""A train of shafts and meshes as a machine.

Each shaft has one rotation, an angle in mrad in its direction of running. A shaft with a bearing
also has the translations x and y in um. The gap of a mesh is how far the driving tooth is ahead of
the driven one along the line of action: r_1 theta_1 - r_2 theta_2 plus the translations.
"""

import math
from collections.abc import Collection, Mapping
from fractions import Fraction

import numpy as np

from gearchaos.models.train.assembly import Assembly
from gearchaos.models.train.geometry import base_radius_mm, contact_ratios
from gearchaos.models.train.tables import Gear, Mesh, Shaft
from gearchaos.models.train.waves import (
    common_orders,
    error_waves,
    orders_of,
    stiffness_waves,
)

INERTIA = 1e6
"""N mm per mrad/ms^2 for a moment of inertia of 1 kg m^2."""

TORQUE = 1e3
"""N mm for a torque of 1 N m."""


def speeds_of(
    shafts: Collection[str], gears: Mapping[str, Gear], meshes: Mapping[str, Mesh], first: str
) -> dict[str, Fraction]:
    """Return the speed of each shaft that meshes connect with the first one, relative to it."""
    speeds = {first: Fraction(1)}
    for _ in shafts:
        for mesh in meshes.values():
            one, other = (gears[name] for name in mesh.gears)
            for known, unknown in ((one, other), (other, one)):
                if known.shaft in speeds and unknown.shaft not in speeds:
                    ratio = Fraction(known.teeth, unknown.teeth)
                    speeds[unknown.shaft] = speeds[known.shaft] * ratio
    return speeds


def blocked_mesh(
    gears: Mapping[str, Gear], meshes: Mapping[str, Mesh], speeds: Mapping[str, Fraction]
) -> str:
    """Return a mesh in which the teeth of both gears do not pass at the same rate, if any."""
    for name, mesh in meshes.items():
        one, other = (gears[gear].teeth * speeds[gears[gear].shaft] for gear in mesh.gears)
        if one != other:
            return name
    return ""


def mesh_orders(
    gears: Mapping[str, Gear], meshes: Mapping[str, Mesh], speeds: Mapping[str, Fraction]
) -> dict[str, int]:
    """Return for each mesh its mesh periods within the common period."""
    rates = {}
    for name, mesh in meshes.items():
        gear = gears[mesh.gears[0]]
        rates[name] = gear.teeth * speeds[gear.shaft]
    return dict(zip(rates, common_orders(list(rates.values())), strict=True))


def first_mesh_rate(
    gears: Mapping[str, Gear], meshes: Mapping[str, Mesh], speeds: Mapping[str, Fraction]
) -> Fraction:
    """Return the mesh periods of the first mesh per revolution of the input shaft."""
    gear = gears[next(iter(meshes.values())).gears[0]]
    return gear.teeth * speeds[gear.shaft]


def assembled(
    shafts: Mapping[str, Shaft],
    gears: Mapping[str, Gear],
    meshes: Mapping[str, Mesh],
    orders: Mapping[str, int],
    effects: Collection[str],
) -> Assembly:
    """Return the parts of a train; ``orders``: of each mesh in the common period."""
    parts = Assembly(orders_of([(mesh, orders[name]) for name, mesh in meshes.items()]))
    for name, shaft in shafts.items():
        if not shaft.uniform:
            force = TORQUE * shaft.torque_Nm
            parts.coordinate(f"{name}_angle", INERTIA * shaft.inertia_kg_m2, force)
        if shaft.bearing_N_per_um is not None and "translation" in effects:
            for axis in "xy":
                parts.coordinate(f"{name}_{axis}", shaft.mass_kg or 1.0)
    for name, mesh in meshes.items():
        _add_mesh(parts, name, mesh, gears, orders[name], effects)
    for name, shaft in shafts.items():
        if shaft.bearing_N_per_um is not None and "translation" in effects:
            _add_bearing(parts, name, shaft, effects)
    return parts


def _add_mesh(
    parts: Assembly,
    name: str,
    mesh: Mesh,
    gears: Mapping[str, Gear],
    order: int,
    effects: Collection[str],
) -> None:
    """Add a mesh as a clearance element."""
    row = _row_of(mesh, gears)
    orders = parts.orders
    ratios = contact_ratios(mesh, gears) if "stiffness_variation" in effects else None
    stiffness = stiffness_waves(mesh, order, orders, ratios)
    error = error_waves(mesh, order, orders)
    if "transmission_error" not in effects:
        error = np.zeros_like(error)
    damping = 2.0 * mesh.damping_ratio * math.sqrt(mesh.mean_stiffness * parts.inertia_along(row))
    backlash = mesh.half_backlash_um if "backlash" in effects else 0.0
    in_contact = mesh.damping_acts == "in_contact" and "backlash" in effects
    parts.element(name, row, (stiffness, error), damping, backlash, in_contact)


def _row_of(mesh: Mesh, gears: Mapping[str, Gear]) -> dict[str, float]:
    """Return the gap of a mesh as a row of coordinates."""
    angle = math.radians(mesh.line_angle_deg)
    row: dict[str, float] = {}
    for name, side in zip(mesh.gears, (1.0, -1.0), strict=True):
        gear = gears[name]
        row[f"{gear.shaft}_angle"] = side * base_radius_mm(gear)
        row[f"{gear.shaft}_x"] = side * math.cos(angle)
        row[f"{gear.shaft}_y"] = side * math.sin(angle)
    return row


def _add_bearing(parts: Assembly, name: str, shaft: Shaft, effects: Collection[str]) -> None:
    """Add the bearing of a shaft: springs, or clearance elements if it has a clearance."""
    stiffness, mass = shaft.bearing_N_per_um or 0.0, shaft.mass_kg or 1.0
    damping = 2.0 * shaft.bearing_damping_ratio * math.sqrt(stiffness * mass)
    clearance = shaft.bearing_half_clearance_um
    for axis in "xy":
        row = {f"{name}_{axis}": 1.0}
        if clearance > 0.0 and "bearing_clearance" in effects:
            waves = np.zeros((2, 1 + 2 * len(parts.orders)))
            waves[0, 0] = stiffness
            parts.element(f"bearing_{name}_{axis}", row, (waves[0], waves[1]), damping, clearance)
        else:
            parts.spring(row, stiffness, damping)
