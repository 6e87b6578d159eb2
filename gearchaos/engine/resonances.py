"""Where mesh orders meet the eigenfrequencies of a sweep, and the static deflection of its mesh."""

from typing import Any, NamedTuple

import numpy as np

from gearchaos.arrays import Floats
from gearchaos.configuration.tables import groups_at, physical_at
from gearchaos.dynamics.eigenfrequencies import eigenfrequencies
from gearchaos.dynamics.systems import system_of
from gearchaos.engine.lanes import Lanes
from gearchaos.gear.derivation import FREQUENCY, LENGTH, derive_scales

ORDERS = (1, 2, 3)
"""Multiples of the mesh frequency that are told."""

LANES = 256  # Lanes that are looked at, spread evenly over the sweep.

UNIT, MESH_FREQUENCY = "per unit of tau", "(mesh frequency)"


class Resonances(NamedTuple):
    """What is known of a sweep before it runs; each value as its smallest and its largest one.

    ``frequencies`` (modes, 2): eigenfrequencies, angular per unit of tau; ``hertz`` the same, and
    ``rpm`` the speeds of the driving gear at which its mesh frequency is one of them;
    ``deflection`` (2,): the static one in b', ``micrometres`` the same. None where the data of the
    pair are not given.
    """

    frequencies: Floats
    hertz: Floats | None
    rpm: Floats | None
    deflection: Floats
    micrometres: Floats | None

    @property
    def texts(self) -> dict[str, str]:
        """Lines for a person, by what they are about."""
        where = "(mean mesh stiffness, teeth in contact)"
        texts = {"modes": f"none that oscillates {where}"}
        if len(self.frequencies):
            values, unit, met, speed = self.frequencies, UNIT, self.frequencies, MESH_FREQUENCY
            if self.hertz is not None:
                values, unit = self.hertz, "Hz"
            if self.rpm is not None:
                met, speed = self.rpm, "rpm"
            texts["modes"] = f"eigenfrequencies {_listed(values)} {unit} {where}"
            orders = (f"order {order} at {_listed(met / order)} {speed}" for order in ORDERS)
            texts["orders"] = f"the mesh meets them with {'; '.join(orders)}"
        bent, unit = self.deflection, "b'"
        if self.micrometres is not None:
            bent, unit = self.micrometres, "um"
        deflection = f"{_span(bent)} {unit} of the mesh under the static load"
        return {**texts, "deflection": f"{deflection}, along the transverse line of action"}

    @property
    def facts(self) -> dict[str, Any]:
        """The same for programs: every value as its smallest and its largest one in the sweep."""
        facts: dict[str, Any] = {"eigenfrequencies": self.frequencies.tolist()}
        facts["resonant_mesh_frequencies"] = _by_order(self.frequencies)
        if self.hertz is not None:
            facts["eigenfrequencies_Hz"] = self.hertz.tolist()
        if self.rpm is not None:
            facts["resonant_speeds_rpm"] = _by_order(self.rpm)
        facts["static_deflection"] = self.deflection.tolist()
        if self.micrometres is not None:
            facts["static_deflection_um"] = self.micrometres.tolist()
        return facts


def resonances(lanes: Lanes) -> Resonances:
    """Return the resonances of the whole scene, with the effects on which nothing kept depends."""
    config, values = lanes.config, lanes.values_of(lanes.spread(LANES))
    system, groups = system_of(config, values), groups_at(config, values)
    scales = derive_scales(physical_at(config, values), groups.load, groups.mesh_frequency)
    scale, length = (
        None if name not in scales else np.broadcast_to(scales[name], (system.lanes,))
        for name in (FREQUENCY, LENGTH)
    )
    found, bent = eigenfrequencies(system), system.static_force()
    hertz = None if scale is None else found * scale[:, np.newaxis] / (2.0 * np.pi)
    teeth = None if config.pair is None else config.pair.teeth
    modes = np.isfinite(found).any(axis=0)
    hertz = None if hertz is None else _ends(hertz[:, modes])
    return Resonances(
        _ends(found[:, modes]),
        hertz,
        None if hertz is None or teeth is None else 60.0 * hertz / teeth[0],
        _ends(bent),
        None if length is None else _ends(bent * length),
    )


def _ends(values: Floats) -> Floats:
    """Return the smallest and the largest value over the lanes, (..., 2)."""
    return np.stack([np.nanmin(values, axis=0), np.nanmax(values, axis=0)], axis=-1)


def _by_order(values: Floats) -> dict[str, Any]:
    return {str(order): (values / order).tolist() for order in ORDERS}


def _listed(values: Floats) -> str:
    return ", ".join(map(_span, values))


def _span(ends: Floats) -> str:
    low, high = (f"{end:.4g}" if abs(end) < 1e4 else f"{end:.0f}" for end in ends.tolist())
    return low if low == high else f"{low} to {high}"
