"""Resonances of mesh orders with eigenfrequencies over a sweep, and its static deflection."""

from typing import Any, NamedTuple

import numpy as np

from gearchaos.arrays import Floats
from gearchaos.dynamics.eigenfrequencies import eigenfrequencies
from gearchaos.engine.lanes import Lanes
from gearchaos.models.registry import system_of

ORDERS = (1, 2, 3)
"""Multiples of the mesh frequency that are reported."""

EXAMINED_LANES = 256
"""Largest number of lanes that are examined, spread evenly over the sweep."""


class Resonances(NamedTuple):
    """Properties of a sweep that are known before it runs, each as minimum and maximum.

    Attributes
    ----------
    frequencies : array, shape (modes, 2)
        Angular eigenfrequencies per unit of tau.
    hertz, rpm : array, shape (modes, 2), or None
        The same in Hz, and the speeds at which the mesh frequency equals them; None without scales.
    deflection : array, shape (2,)
        Static deflection in units of b'; NaN where the model has none.
    micrometres : array, shape (2,), or None
        The same in micrometres.
    free : array, shape (modes, 2)
        Angular eigenfrequencies without contact, in Hz with scales; empty where they are left out.
    rate_words, free_words, contact_words, deflection_words, exciter : str
        Descriptions of contact, of the deflection and of what excites, see `Model`.
    """

    frequencies: Floats
    hertz: Floats | None
    rpm: Floats | None
    deflection: Floats
    micrometres: Floats | None
    free: Floats
    rate_words: str
    free_words: str
    contact_words: str
    deflection_words: str
    exciter: str

    @property
    def texts(self) -> dict[str, str]:
        """Lines for a person, by subject."""
        where = f"({self.contact_words})"
        texts = {"modes": f"none that oscillates {where}"}
        if len(self.frequencies):
            values, unit, met = self.frequencies, self.rate_words, self.frequencies
            speed = f"({self.exciter} frequency)"
            if self.hertz is not None:
                values, unit = self.hertz, "Hz"
            if self.rpm is not None:
                met, speed = self.rpm, "rpm"
            texts["modes"] = f"eigenfrequencies {_listed(values)} {unit} {where}"
            orders = (f"order {order} at {_listed(met / order)} {speed}" for order in ORDERS)
            texts["orders"] = f"resonances with the {self.exciter}: {'; '.join(orders)}"
        if len(self.free):
            unit = self.rate_words if self.hertz is None else "Hz"
            texts["free"] = f"eigenfrequencies {_listed(self.free)} {unit} ({self.free_words})"
        bent, unit = self.deflection, "b'"
        if self.micrometres is not None:
            bent, unit = self.micrometres, "um"
        if np.isfinite(bent).all():
            texts["deflection"] = f"{_span(bent)} {unit} {self.deflection_words}"
        return texts

    @property
    def facts(self) -> dict[str, Any]:
        """Values for programs, each as minimum and maximum over the sweep."""
        facts: dict[str, Any] = {"eigenfrequencies": self.frequencies.tolist()}
        facts["resonant_mesh_frequencies"] = _by_order(self.frequencies)
        if self.hertz is not None:
            facts["eigenfrequencies_Hz"] = self.hertz.tolist()
        if len(self.free):
            unit = "" if self.hertz is None else "_Hz"
            facts[f"free_eigenfrequencies{unit}"] = self.free.tolist()
        if self.rpm is not None:
            facts["resonant_speeds_rpm"] = _by_order(self.rpm)
        # JSON has no NaN.
        if np.isfinite(self.deflection).all():
            facts["static_deflection"] = self.deflection.tolist()
        if self.micrometres is not None:
            facts["static_deflection_um"] = self.micrometres.tolist()
        return facts


def resonances(lanes: Lanes) -> Resonances:
    """Return the resonances of the whole scene, including effects on which no output depends."""
    config, values = lanes.config, lanes.values_of(lanes.spread(EXAMINED_LANES))
    system, scales = system_of(config, values), lanes.model.scales(config, values)
    found, bent = eigenfrequencies(system), system.static_force()
    modes, hertz, rpm = np.isfinite(found).any(axis=0), None, None
    free = eigenfrequencies(system, free=True) if lanes.model.free_words else found[:, :0]
    free = free[:, np.isfinite(free).any(axis=0)]
    if scales.frequency is not None:
        free = free * scales.frequency[:, np.newaxis] / (2.0 * np.pi)
        hertz = _ends((found * scales.frequency[:, np.newaxis] / (2.0 * np.pi))[:, modes])
        rpm = None if scales.speed is None else scales.speed * hertz
    return Resonances(
        _ends(found[:, modes]),
        hertz,
        rpm,
        _ends(bent),
        None if scales.length is None else _ends(bent * scales.length),
        _ends(free),
        lanes.model.rate_words,
        lanes.model.free_words,
        lanes.model.contact_words,
        lanes.model.deflection_words,
        lanes.model.exciter,
    )


def _ends(values: Floats) -> Floats:
    """Return minimum and maximum over the lanes, (..., 2)."""
    if np.isnan(values).all():
        return np.full((*values.shape[1:], 2), np.nan)
    return np.stack([np.nanmin(values, axis=0), np.nanmax(values, axis=0)], axis=-1)


def _by_order(values: Floats) -> dict[str, Any]:
    """Return values divided by each order, by order."""
    return {str(order): (values / order).tolist() for order in ORDERS}


def _listed(values: Floats) -> str:
    """Return all ranges in words."""
    return ", ".join(map(_span, values))


def _span(ends: Floats) -> str:
    """Return one range in words."""
    low, high = (f"{end:.4g}" if abs(end) < 1e4 else f"{end:.0f}" for end in ends.tolist())
    return low if low == high else f"{low} to {high}"
