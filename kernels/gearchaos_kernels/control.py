"""Feedback control: an input of every lane is chosen anew at the beginning of every mesh period.

The input is added to the steady input of the model, the load of a gear pair, and held constant over
the period. With a target orbit r and a state x at the beginning of the period::

    u = -K_j (x - r_j)   if this is at most the limit, otherwise 0

j is the number of the nearest point of the orbit. Instead of x, a controller may use an estimate z.
It corrects z by the measured states y = C x + noise, and predicts it for the next period::

    z <- z + L_j (y - C z),    then    z <- r_j+1 + A_j (z - r_j) + b_j u

Delayed feedback compares with the state n mesh periods earlier instead of an orbit. A tangent
vector contains the variation of the input, so that its growth is that of the closed loop.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.block_memory import read_lane, slots_of
from gearchaos_kernels.memory.lines import (
    add_line,
    correct_line,
    gather_line,
    predict_line,
    product_of_deviation,
    product_of_line,
    scale_line,
    vary_line,
)
from gearchaos_kernels.memory.rows import STATE, STRIDE, control_rows, rows
from gearchaos_kernels.methods.protocol import change_input
from gearchaos_kernels.plan import Floats

CENTRE = (
    2509.0809287301226727,
    33430.575583588128105,
    67265.770927008700853,
    45921.953931549871457,
    13731.693765509461125,
    1971.5909503065514427,
    133.14166789178437745,
    3.387132872796366608,
)
CENTRE_BELOW = (
    5226.495278852545925,
    28729.085735721942674,
    39307.89580009271061,
    21213.794301586595867,
    5394.1960214247511077,
    687.1870074920579083,
    42.313330701600911252,
    1.0,
)
TAIL = (
    7.7454501427834140764e-4,
    0.0227238449892691845833,
    0.24178072517745061177,
    1.27045825245236838258,
    3.64784832476320460504,
    5.7694972214606914055,
    4.6303378461565452959,
    1.42343711074968357734,
)
TAIL_BELOW = (
    1.05075007164441684324e-9,
    5.475938084995344946e-4,
    0.0151986665636164571966,
    0.14810397642748007459,
    0.68976733498510000455,
    1.6763848301838038494,
    2.05319162663775882187,
    1.0,
)
"""Coefficients of `quantile` in the middle and in the tails, above and below the bar."""


@dataclass(frozen=True)
class Feedback:
    """The parts of a controller that the compiled loop contains.

    Attributes
    ----------
    estimated : True or None
        Whether the controller estimates the state from measured ones.
    delay : int
        Mesh periods of a delayed feedback; 0 for a target orbit.
    states : int
        Number of states.
    signals : int
        Number of measured states from which an estimate is corrected, otherwise 0.
    """

    estimated: Any
    delay: int
    states: int
    signals: int


class Control(NamedTuple):
    """The controller of every lane; states and inputs are in the units of the equations.

    Attributes
    ----------
    points : array, shape (lanes, points, states)
        The target orbit at the beginning of successive mesh periods.
    gain : array, shape (lanes, points, states)
        The gains K.
    scales : array, shape (lanes, states)
        Scales of the states, by which the nearest point of the orbit is found.
    limit : array, shape (lanes,)
        Largest absolute input; a larger one is replaced by 0.
    begins : int
        Number of the mesh period in which the control begins, counted from tau = 0.
    repeats : int
        Mesh periods after which the excitation repeats. The number of points is a multiple.
    measured : array of int, shape (signals,)
        Numbers of the measured states. Without a transition matrix, all states.
    noise : array, shape (lanes, signals)
        Standard deviations of the measurement noise.
    seeds : array of uint64, shape (lanes,)
        Seeds of the noise.
    transition : array, shape (lanes, points, states, states) or (lanes, 0, states, states)
        The matrices A of the estimate; empty if the state itself is used.
    response : array, shape (lanes, points, states)
        The vectors b of the estimate.
    correction : array, shape (lanes, points, states, signals)
        The matrices L of the estimate.
    delay : int
        Mesh periods of a delayed feedback, 0 for a target orbit. The gain is that of the nearest
        point.

    Examples
    --------
    A gain of zero for one point of an orbit measures all states and changes nothing:

    >>> point = np.zeros((1, 1, 6))
    >>> open_loop = Control.of_states(point, point, np.full(1, 0.1))
    >>> open_loop.flags().states
    6
    """

    points: Floats
    gain: Floats
    scales: Floats
    limit: Floats
    begins: int
    repeats: int
    measured: NDArray[np.intp]
    noise: Floats
    seeds: NDArray[np.uint64]
    transition: Floats
    response: Floats
    correction: Floats
    delay: int = 0

    @classmethod
    def of_states(cls, points: Floats, gain: Floats, limit: Floats, repeats: int = 1) -> "Control":
        """Return a controller that knows all states without noise.

        Parameters
        ----------
        points, gain : array, shape (lanes, points, states)
            Target orbit and gains.
        limit : array, shape (lanes,)
            Largest absolute input.
        repeats : int
            Mesh periods after which the excitation repeats.

        Returns
        -------
        Control
            The controller, which begins at once.

        Examples
        --------
        >>> point = np.zeros((2, 1, 6))
        >>> Control.of_states(point, point, np.ones(2)).noise.shape
        (2, 6)
        """
        lanes, _, states = points.shape
        return cls(
            np.ascontiguousarray(points, dtype=np.float64),
            np.ascontiguousarray(gain, dtype=np.float64),
            np.ones((lanes, states)),
            np.ascontiguousarray(limit, dtype=np.float64),
            0,
            repeats,
            np.arange(states),
            np.zeros((lanes, states)),
            np.zeros(lanes, dtype=np.uint64),
            np.zeros((lanes, 0, states, states)),
            np.zeros((lanes, 0, states)),
            np.zeros((lanes, 0, states, states)),
        )

    @property
    def remembers(self) -> bool:
        """Whether an estimate or earlier states act on the motion, beside the state itself."""
        return self.delay > 0 or self.transition.shape[1] > 0

    def of(self, chosen: Any) -> "Control":
        """Return the controllers of some lanes.

        Parameters
        ----------
        chosen : array of int or slice
            Numbers of the lanes, in the order of the new controllers.

        Returns
        -------
        Control
            Their controllers.

        Examples
        --------
        >>> point = np.zeros((3, 1, 6))
        >>> Control.of_states(point, point, np.ones(3)).of([0, 0]).limit.shape
        (2,)
        """
        return self._replace(**{name: getattr(self, name)[chosen] for name in OF_LANES})

    def settled(self) -> "Control":
        """Return the controllers as they act after their beginning, without noise.

        Returns
        -------
        Control
            Controllers that act in every mesh period.

        Examples
        --------
        >>> point = np.zeros((1, 1, 6))
        >>> Control.of_states(point, point, np.ones(1))._replace(begins=9).settled().begins
        0
        """
        return self._replace(begins=0, noise=np.zeros_like(self.noise))

    def flags(self) -> Feedback:
        """Return what the compiled loop contains of the controller.

        Returns
        -------
        Feedback
            The flags.

        Examples
        --------
        >>> point = np.zeros((1, 1, 6))
        >>> Control.of_states(point, point, np.ones(1)).flags().estimated is None
        True
        """
        estimated = True if self.transition.shape[1] else None
        signals = self.measured.size if estimated else 0
        return Feedback(estimated, self.delay, self.points.shape[2], signals)


OF_LANES = (
    "points",
    "gain",
    "scales",
    "limit",
    "noise",
    "seeds",
    "transition",
    "response",
    "correction",
)
"""Fields of `Control` with one row for each lane."""


class Actuation(NamedTuple):
    """The controllers of a batch and how their inputs act on lanes, as blocks read them.

    Vectors of all states are lines, see `line_of`.

    Attributes
    ----------
    points, gain, response : array, shape (lanes, points, line)
        See `Control`.
    scales, limit, measured, noise, seeds : array
        See `Control`.
    columns_of_transition : array, shape (lanes, points or 0, states, line)
        `Control.transition` with its columns as rows.
    columns_of_correction : array, shape (lanes, points or 0, signals, line)
        `Control.correction` with its columns as rows.
    steady : array, shape (lanes,)
        The steady input of a lane, per step squared, without control.
    strength : array, shape (lanes,)
        Change of the steady input of a lane, per step squared, by an input of 1.
    inputs : array, shape (lanes, periods)
        The input of every mesh period, written by the blocks.
    about : array of int, shape (5,)
        Place of the steady input among the coefficients of a lane, mesh periods before the first
        one, the mesh period in which the control begins, `Control.repeats`, and 1 if there is
        noise, otherwise 0.
    """

    points: Floats
    gain: Floats
    scales: Floats
    limit: Floats
    measured: NDArray[np.intp]
    noise: Floats
    seeds: NDArray[np.uint64]
    response: Floats
    columns_of_transition: Floats
    columns_of_correction: Floats
    steady: Floats
    strength: Floats
    inputs: Floats
    about: NDArray[np.intp]


@scalar
def act(memory, block, period, batch, control, scene):
    """Choose the input of all lanes of a block for a mesh period, and its variation.

    ``control``: the `Actuation`.
    """
    column, repeats = control.about[0], control.about[3]
    phase = control.about[1] + period
    # Once for all lanes: a division takes as long as the feedback of a lane.
    moment = phase, phase % repeats
    for slot in range(slots_of(block.lanes)):
        index = batch.order[block.first + min(slot, block.lanes - 1)]
        if period == 0:
            prepare(memory, slot, index, control, batch.scales, scene)
        measure(memory, slot, index, moment, control, batch.scales, scene)
        # A corrected estimate may be nearer to another point.
        place = index, nearest_point(memory, slot, moment[1], control, index, scene)
        found = demanded(memory, slot, place, control, scene)
        used = phase >= control.about[2] and abs(found) <= control.limit[index]
        effort = found if used else 0.0
        varied = 0.0
        if scene.tangent is not None:
            if used:
                varied = demanded_variation(memory, slot, place, control, scene)
        predict(memory, slot, place, (effort, varied), control, scene)
        strength = control.strength[index]
        coefficient = control.steady[index] + strength * effort
        memory[(rows(scene).coefficients + column) * STRIDE + slot] = coefficient
        memory[control_rows(scene).varied * STRIDE + slot] = strength * varied
        change_input(memory, slot, read_lane(memory, slot, scene), scene)
        if slot < block.lanes:
            control.inputs[index, period] = effort


@scalar
def state_at(memory, slot, index, state, scales):
    """Return one state of a lane in the units of the equations."""
    # A row of the scales would be an array of its own, whose references are counted.
    return memory[(STATE + state) * STRIDE + slot] * scales[index, state]


@scalar
def prepare(memory, slot, index, control, scales, scene):
    """Begin the estimate at the first point of the orbit, and the delay at the first state."""
    at = control_rows(scene)
    known, known_varied = line_at(at.known, slot, scene), line_at(at.known_varied, slot, scene)
    # Beyond the states as well: uninitialised numbers may be denormal, which is slow.
    for number in range(at.line):
        memory[known + number] = control.points[index, 0, number]
        memory[known_varied + number] = 0.0
    for state in range(at.states):
        for earlier in range(at.delay):
            row = earlier * at.states + state
            value = state_at(memory, slot, index, state, scales)
            memory[(at.earlier + row) * STRIDE + slot] = value
            memory[(at.earlier_varied + row) * STRIDE + slot] = 0.0


@scalar
def line_at(first, slot, scene):
    """Return the place of the line of a slot."""
    return first * STRIDE + slot * control_rows(scene).line


@scalar
def measure(memory, slot, index, moment, control, scales, scene):
    """Store what the controller knows of the state, and the same of the tangent vector.

    ``moment``: number of the mesh period, and the phase of the excitation in mesh periods.
    """
    at, tangent = control_rows(scene), rows(scene).tangent
    known, known_varied = line_at(at.known, slot, scene), line_at(at.known_varied, slot, scene)
    sizes, first = (scales, index * at.states), 0
    if scene.feedback.estimated is not None:
        nearest = nearest_point(memory, slot, moment[1], control, index, scene)
        first = place_of((index, nearest), control) * control.measured.shape[0] * at.line
        measured, correction = control.measured, (control.columns_of_correction, first)
        correct_line(memory, known, (STATE, slot), sizes, measured, correction, scene)
        if scene.tangent is not None:
            varied = tangent, slot
            correct_line(memory, known_varied, varied, sizes, measured, correction, scene)
    else:
        gather_line(memory, known, (STATE, slot), sizes, scene)
        if scene.tangent is not None:
            gather_line(memory, known_varied, (tangent, slot), sizes, scene)
    if control.about[4] > 0:
        add_noise(memory, known, (index, first), moment[0], control, scene)


@scalar
def add_noise(memory, known, place, period, control, scene):
    """Add what the noise of the measured states changes.

    ``known``: the line of what is known of the state; ``place``: the lane, and where its correction
    begins; ``period``: number of the mesh period.
    """
    (index, first), at = place, control_rows(scene)
    signals, columns = control.measured.shape[0], control.columns_of_correction
    for signal in range(signals):
        noise = control.noise[index, signal]
        if noise > 0.0:
            state = control.measured[signal]
            number = noise * gaussian(control.seeds[index], period * signals + signal)
            if scene.feedback.estimated is not None:
                add_line(memory, known, number, columns, first + signal * at.line, scene)
            else:
                memory[known + state] += number


@scalar
def place_of(place, control):
    """Return the number of a point among the points of all lanes."""
    return place[0] * control.points.shape[1] + place[1]


@scalar
def nearest_point(memory, slot, first, control, index, scene):
    """Return the number of the orbit's point that is nearest to what is known of the state.

    Only points at the same phase of the excitation are compared; ``first``: the first of them.
    """
    points, repeats = control.points.shape[1], control.about[3]
    known = line_at(control_rows(scene).known, slot, scene)
    nearest = first
    if points == repeats:
        return nearest
    least = math.inf
    for point in range(first, points, repeats):
        distance = 0.0
        for state in range(control_rows(scene).states):
            value = memory[known + state] - control.points[index, point, state]
            distance += (value / control.scales[index, state]) ** 2
        if distance < least:
            nearest, least = point, distance
    return nearest


@scalar
def demanded(memory, slot, place, control, scene):
    """Return the input that the gains demand, -K times a deviation.

    ``place``: the lane and the nearest point of the orbit.
    """
    at, number = control_rows(scene), place_of(place, control) * control_rows(scene).line
    known = line_at(at.known, slot, scene)
    if at.delay > 0:
        now = product_of_line(memory, known, control.gain, number, scene)
        return delayed(memory, slot, place, at.earlier, control, scene) - now
    return -product_of_deviation(memory, known, control.points, control.gain, number, scene)


@scalar
def demanded_variation(memory, slot, place, control, scene):
    """Return the variation of the demanded input; the orbit does not vary."""
    at, number = control_rows(scene), place_of(place, control) * control_rows(scene).line
    known_varied = line_at(at.known_varied, slot, scene)
    now = product_of_line(memory, known_varied, control.gain, number, scene)
    if at.delay > 0:
        return delayed(memory, slot, place, at.earlier_varied, control, scene) - now
    return -now


@scalar
def delayed(memory, slot, place, earlier, control, scene):
    """Return K times the earliest of the states that are kept from a row on."""
    (index, nearest), at = place, control_rows(scene)
    first = earlier + (at.delay - 1) * at.states
    total = 0.0
    for state in range(at.states):
        total += control.gain[index, nearest, state] * memory[(first + state) * STRIDE + slot]
    return total


@scalar
def predict(memory, slot, place, chosen, control, scene):
    """Keep what the next period needs: the predicted estimate, or the states of the delay.

    ``place``: the lane and the nearest point of the orbit; ``chosen``: the input and its variation
    along the tangent vector.
    """
    at = control_rows(scene)
    known, known_varied = line_at(at.known, slot, scene), line_at(at.known_varied, slot, scene)
    for back in range(at.delay - 1, -1, -1):
        for state in range(at.states):
            move_back(memory, slot, (back, state), (known, at.earlier), scene)
            if scene.tangent is not None:
                move_back(memory, slot, (back, state), (known_varied, at.earlier_varied), scene)
    if scene.feedback.estimated is not None:
        index, nearest = place
        following = nearest + 1 if nearest + 1 < control.points.shape[1] else 0
        now, then = place_of(place, control), place_of((index, following), control)
        maps = control.response, control.columns_of_transition
        points = control.points, now * at.line, then * at.line
        predict_line(memory, known, points, maps, chosen[0], scene)
        if scene.tangent is not None:
            vary_line(memory, known_varied, now * at.line, maps, chosen[1], scene)


@scalar
def move_back(memory, slot, number, sources, scene):
    """Store one state one period further back, where the delay keeps it.

    ``number``: periods back, and the state; ``sources``: the line of what is known, and the first
    row of earlier states.
    """
    (back, state), (known, earlier), states = number, sources, control_rows(scene).states
    row = earlier + back * states + state
    if back == 0:
        memory[row * STRIDE + slot] = memory[known + state]
    else:
        memory[row * STRIDE + slot] = memory[(row - states) * STRIDE + slot]


@scalar
def scale_variations(memory, slot, factor, scene):
    """Multiply all variations of the controller by a factor, with the tangent vector."""
    at = control_rows(scene)
    memory[at.varied * STRIDE + slot] *= factor
    if scene.feedback.estimated is not None:
        scale_line(memory, line_at(at.known_varied, slot, scene), factor, scene)
    for number in range(at.delay * at.states):
        memory[(at.earlier_varied + number) * STRIDE + slot] *= factor


@scalar
def gaussian(seed, number):
    """Return a normally distributed number that depends on a seed and a counter only.

    The quantile of a uniform number, which is an output of SplitMix64 (Steele, Lea, Flood 2014).
    """
    return quantile(uniform(mixed(seed + np.uint64(number + 1) * np.uint64(0x9E3779B97F4A7C15))))


@scalar
def mixed(number):
    """Return the output function of SplitMix64."""
    number = (number ^ (number >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    number = (number ^ (number >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return number ^ (number >> np.uint64(31))


@scalar
def uniform(number):
    """Return a number between 0 and 1, without both, from 64 bits."""
    return (float(number >> np.uint64(12)) + 0.5) * 2.0**-52


@scalar
def quantile(share):
    """Return the value that a normally distributed number is below with a probability.

    Algorithm AS 241 of Wichura (1988), PPND16. Sizes above 6.7, one in 4e10, are cut to it.
    """
    middle = share - 0.5
    if abs(middle) <= 0.425:
        r = 0.180625 - middle * middle
        return middle * horner(r, CENTRE) / horner(r, CENTRE_BELOW)
    r = min(math.sqrt(-math.log(min(share, 1.0 - share))), 5.0) - 1.6
    size = horner(r, TAIL) / horner(r, TAIL_BELOW)
    return size if middle > 0.0 else -size


@scalar
def horner(x, coefficients):
    """Return a polynomial whose coefficients begin with that of the highest power."""
    total = 0.0
    for coefficient in coefficients:
        total = total * x + coefficient
    return total
