"""Other programs know every unit of a key, a group or a result, with the same meaning."""

import re
import shutil
import subprocess

import pint
import pytest

from gearchaos.configuration.base import configuration_keys
from gearchaos.models import GearPairConfiguration
from gearchaos.models.gear_pair.derivation import SCALES
from gearchaos.models.gear_pair.group_table import GROUP_TABLE
from gearchaos.models.gear_pair.outputs import CATALOGUE

KEYS = configuration_keys(GearPairConfiguration)

PHYSICAL = ("delta_5", "delta_5_rate", "delta_5_acceleration", "mesh_force_tangential")
PHYSICAL += ("lyapunov_exponent", "mesh_frequency", "period")
UNITS = {one.units for one in (*KEYS.values(), *GROUP_TABLE)} - {""}
UNITS |= {units for units, *_ in SCALES.values()} | {
    CATALOGUE.scale_of(name).units for name in PHYSICAL
}
REGISTRY = pint.UnitRegistry()


@pytest.mark.parametrize("unit", sorted(UNITS))
def test_pint_and_udunits_agree_on_a_unit(unit: str) -> None:
    factor = float(REGISTRY(unit).to_base_units().magnitude) if unit != "1" else 1.0
    if shutil.which("udunits2") is None:
        pytest.skip("the program udunits2 is not installed")
    done = subprocess.run(["udunits2", "-H", unit, "-W", ""], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    said = re.match(r"\s*([\d.e+-]+)(?= )", done.stdout)
    assert (float(said[1]) if said else 1.0) == pytest.approx(factor, rel=1e-12)
