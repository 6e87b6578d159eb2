"""The states, effects and dimensionless groups of eq. 13 of Pan 2021."""

from typing import NamedTuple

import numpy as np

from gearchaos_kernels.plan import Floats

STATES = tuple(f"delta_{n}{kind}" for n in (5, 1, 2, 3, 4) for kind in ("", "_rate"))
"""The states of eq. 13 of Pan 2021 in their one order; a scene has those of its effects."""


class Effects(NamedTuple):
    """Which effects act; what is off is absent from the compiled loop.

    Attributes
    ----------
    pitch_error : bool
        The pitch error e(tau) forces the pair (eq. 14).
    stiffness_variation : bool
        The mesh stiffness varies with the mesh phase (eq. 19).
    backlash : bool
        The teeth have clearance (eqs 22, 23).
    transverse, axial : bool
        The bearings give way in the transverse and in the axial direction.
    """

    pitch_error: bool = True
    stiffness_variation: bool = True
    backlash: bool = True
    transverse: bool = True
    axial: bool = True

    @property
    def states(self) -> tuple[str, ...]:
        """The states that there are, in the order of `STATES`."""
        present = np.repeat([True, self.transverse, self.axial], [2, 4, 4])
        return tuple(name for name, there in zip(STATES, present, strict=True) if there)


class Groups(NamedTuple):
    """Dimensionless groups of eqs 8-13 of Pan 2021, each an array of shape (lanes,).

    Groups of an effect that is off are ignored; 1 is a safe filling for the mass ratios and 0 for
    everything else. Subscripts p and g: driving and driven gear.

    Attributes
    ----------
    mesh_frequency
        Omega, angular mesh frequency per unit of tau.
    load
        f_n, static load.
    damping_ratio
        xi, of the mesh.
    base_helix_angle
        beta_b in rad.
    half_backlash
        b, half the clearance.
    error_mean, error_amplitude
        P e_0 and P e_r in units of b' (eq. 14).
    error_phase
        phi in rad.
    stiffness_variation_scale
        Factor of the harmonics of the mesh stiffness.
    mass_ratio_p, mass_ratio_g
        m_e / m_p and m_e / m_g.
    transverse_stiffness_p, transverse_stiffness_g, axial_stiffness_p, axial_stiffness_g
        k_11, k_21, k_12 and k_22, of the bearings.
    transverse_damping_p, transverse_damping_g, axial_damping_p, axial_damping_g
        eta_11, eta_21, eta_12 and eta_22, of the bearings.
    """

    mesh_frequency: Floats
    load: Floats
    damping_ratio: Floats
    base_helix_angle: Floats
    half_backlash: Floats
    error_mean: Floats
    error_amplitude: Floats
    error_phase: Floats
    stiffness_variation_scale: Floats
    mass_ratio_p: Floats
    mass_ratio_g: Floats
    transverse_stiffness_p: Floats
    transverse_damping_p: Floats
    transverse_stiffness_g: Floats
    transverse_damping_g: Floats
    axial_stiffness_p: Floats
    axial_damping_p: Floats
    axial_stiffness_g: Floats
    axial_damping_g: Floats
