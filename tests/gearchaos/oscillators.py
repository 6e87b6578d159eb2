"""The oscillator of the kernels' tests as a model that can be configured and swept."""

from dataclasses import fields

import numpy as np

from gearchaos.configuration import Configuration
from gearchaos.configuration.keys import Table
from gearchaos.configuration.ranges import Range
from gearchaos.configuration.tables import Parameter
from gearchaos.models.protocol import Model
from gearchaos.models.registry import MODELS
from gearchaos.outputs import catalogue
from gearchaos.outputs.entries import Kind, Subject, motion_subjects
from gearchaos.outputs.listing import Catalogue

from ..kernels.oscillator import Oscillators

X, X_RATE, X_ACCELERATION = motion_subjects("x", "x", "{} of the mass")
NAMES = [field.name for field in fields(Oscillators)]
STATES = {Kind.STATE: (X, X_RATE), Kind.ACCELERATION: (X_ACCELERATION,)}
STOP = Subject("stop", "stop", "$F$")


class OscillatorConfiguration(Configuration):
    class Oscillator(Table):
        frequency: float = 0.7
        damping: float = 0.05
        half_clearance: float = 1.0
        load: float = 0.1
        amplitude: float = 0.1

    kind = "oscillator"
    parameters = {name: Parameter(name, f"oscillator.{name}", Range()) for name in NAMES}  # noqa: RUF012
    states = property(lambda _self: (X.name, X_RATE.name))
    oscillator: Oscillator = Oscillator()


class OscillatorModel(Model):
    catalogue = Catalogue(parts=catalogue.PARTS, subjects={**STATES, Kind.ELEMENT: (STOP,)})
    signals = ("x",)

    def system(self, config, values, _effects):
        given = {**config.oscillator.tables(), **values}
        lanes = np.broadcast_arrays(*(given[name] for name in NAMES))
        return Oscillators(*(np.array(one, dtype=np.float64) for one in lanes))

    def elements(self, _effects):
        return (STOP.name,)


MODELS[OscillatorConfiguration.kind] = lambda _config: OscillatorModel()
