"""The states, effects and dimensionless groups of eq. 13 of Pan 2021."""

from typing import NamedTuple

import numpy as np

from gearchaos_kernels.plan import Floats

STATES = tuple(f"delta_{n}{kind}" for n in (5, 1, 2, 3, 4) for kind in ("", "_rate"))
"""All states of eq. 13 of Pan 2021, in the order used everywhere; see `Effects.states`."""


class Effects(NamedTuple):
    """Which effects act. Effects that are off are absent from the compiled loop.

    Attributes
    ----------
    pitch_error : bool
        The pitch error e(tau) forces the pair (eq. 14).
    stiffness_variation : bool
        The mesh stiffness varies with the mesh phase (eq. 19).
    backlash : bool
        The teeth have clearance (eqs 22, 23).
    transverse, axial : bool
        The bearings are flexible in the transverse and in the axial direction.
    friction : bool
        The teeth slide on each other with friction, which Pan 2021 leaves out.

    Examples
    --------
    >>> Effects(transverse=False, axial=False).states
    ('delta_5', 'delta_5_rate')
    """

    pitch_error: bool = True
    stiffness_variation: bool = True
    backlash: bool = True
    transverse: bool = True
    axial: bool = True
    friction: bool = False

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states of a pair with these effects, in the order of `STATES`."""
        present = np.repeat([True, self.transverse, self.axial], [2, 4, 4])
        return tuple(name for name, there in zip(STATES, present, strict=True) if there)


class Groups(NamedTuple):
    """Dimensionless groups of eqs 8-13 of Pan 2021.

    Every field is an array of shape (lanes,). The subscripts p and g denote the driving and the
    driven gear. Groups of an effect that is off do not enter the equations; fill them with 1 for
    mass ratios and with 0 otherwise.

    Attributes
    ----------
    mesh_frequency : array
        Omega, angular mesh frequency in rad per unit of tau.
    load : array
        f_n, static load.
    damping_ratio : array
        xi, damping ratio of the mesh.
    base_helix_angle : array
        beta_b in rad.
    half_backlash : array
        b, half the clearance.
    error_mean, error_amplitude : array
        P e_0 and P e_r in units of b' (eq. 14).
    error_phase : array
        phi in rad (eq. 14).
    stiffness_variation_scale : array
        Factor of the harmonics of the mesh stiffness (eq. 19).
    mass_ratio_p, mass_ratio_g : array
        m_e / m_p and m_e / m_g.
    transverse_stiffness_p, transverse_stiffness_g, axial_stiffness_p, axial_stiffness_g : array
        k_11, k_21, k_12 and k_22, stiffnesses of the bearings.
    transverse_damping_p, transverse_damping_g, axial_damping_p, axial_damping_g : array
        eta_11, eta_21, eta_12 and eta_22, damping ratios of the bearings.
    friction_coefficient : array
        mu, coefficient of the friction between the teeth.
    friction_lever : array
        lambda, the lever of friction relative to that of the mesh force, at the pitch point.
    pitch_point_phase : array
        phi_C in rad, the mesh phase at which the contact passes the pitch point.

    Examples
    --------
    Two lanes that differ in the amplitude of the pitch error::

        groups = Groups(**{name: np.full(2, value) for name, value in values.items()})
        groups = groups._replace(error_amplitude=np.array([5.0, 10.0]))
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
    friction_coefficient: Floats
    friction_lever: Floats
    pitch_point_phase: Floats
