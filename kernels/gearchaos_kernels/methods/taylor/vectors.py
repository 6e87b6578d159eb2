"""The arithmetic of series as explicit vectors of eight lanes: loops over their terms.

Each function serves the eight lanes from ``slot`` on. Products and sums of one row do not wait for
those of another one: a few rows are computed in the same loop (`_TOGETHER`).
"""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from numba import types
from numba.extending import intrinsic

from gearchaos_kernels.memory.rows import STATE, STRIDE, rows_of
from gearchaos_kernels.memory.vector_code import DOUBLE, INTEGER, VectorCode
from gearchaos_kernels.methods.taylor.layout import TERMS, series_rows_of
from gearchaos_kernels.scene import Scene, provider_of

_TOGETHER = 6
"""Rows that are computed in the same loop: their numbers fit into the registers."""


class _Part(NamedTuple):
    """Rows of the motion, or of the tangent vector."""

    state: int
    term: int
    series: int
    gap: int
    gaps: int
    sums: int


def _parts(scene: Scene) -> list[_Part]:
    """Return the rows of the motion, and of the tangent vector if there is one."""
    at = series_rows_of(scene)
    parts = [_Part(STATE, at.term, at.series, at.gap, at.gaps, at.sums)]
    if scene.tangent is not None:
        first = rows_of(scene).tangent
        tangent = at.tangent_term, at.tangent_series, at.tangent_gap, at.tangent_gaps
        parts.append(_Part(first, *tangent, at.tangent_sums))
    return parts


def _in_groups(rows: Sequence[Any]) -> Iterator[Sequence[Any]]:
    """Yield groups of rows that are computed in the same loop."""
    for first in range(0, len(rows), _TOGETHER):
        yield rows[first : first + _TOGETHER]


def _places(first: int, count: int) -> list[int]:
    """Return consecutive rows."""
    return list(range(first, first + count))


def _copy(w: VectorCode, vector: Any, source: Sequence[int], target: Any, first: int) -> None:
    """Copy rows to consecutive rows after an address."""
    for number, value in enumerate(w.rows(vector, source)):
        w.store(value, target, (first + number) * STRIDE)


@intrinsic
def begin_term(_typing, memory, slot, scene):
    """Begin all series with state, tangent vector and waves where a piece begins."""
    at = series_rows_of(scene.scene)

    def generate(context, builder, signature, arguments):
        w = VectorCode(context, builder, signature, arguments)
        vector = w.element(0, arguments[1])
        for part in _parts(scene.scene):
            states = _places(part.state, 2 * at.coordinates)
            _copy(w, vector, states, vector, part.term)
            _copy(w, vector, states[::2], vector, part.series)
        _copy(w, vector, _places(at.waves, at.waves_in_all), vector, at.wave_term)
        return context.get_dummy_value()

    return types.void(memory, types.intp, scene), generate


@intrinsic
def keep_term(_typing, memory, slot, number, scene):
    """Keep term n of gaps and stiffnesses, and term n + 1 of the positions; advance the waves."""
    at = series_rows_of(scene.scene)

    def generate(context, builder, signature, arguments):
        w = VectorCode(context, builder, signature, arguments)
        vector, number = w.element(0, arguments[1]), arguments[2]
        of_elements = w.moved(vector, number, at.elements * STRIDE)
        following = builder.add(number, INTEGER(1))
        of_positions = w.moved(vector, following, at.coordinates * STRIDE)
        for part in _parts(scene.scene):
            positions = _places(part.term, 2 * at.coordinates)[::2]
            _copy(w, vector, positions, of_positions, part.series)
            _copy(w, vector, _places(part.gap, at.elements), of_elements, part.gaps)
        _copy(w, vector, _places(at.stiffness, at.elements), of_elements, at.stiffnesses)
        angle = w.load(vector, at.angle * STRIDE)
        turn_terms(w, vector, angle, following)
        return context.get_dummy_value()

    def turn_terms(w, vector, angle, following):
        pairs = _terms_of_waves(w, vector, at.wave_term, at.waves_in_all)
        turned = _turned(w, scene.scene, pairs, angle, following)
        for row, value in enumerate(turned):
            w.store(value, vector, (at.wave_term + row) * STRIDE)

    return types.void(memory, types.intp, types.intp, scene), generate


def _terms_of_waves(w: VectorCode, vector: Any, first: int, count: int) -> list[Any]:
    """Return cosine and sine of every harmonic from consecutive rows."""
    return w.rows(vector, _places(first, count))


def _turned(w: VectorCode, scene: Scene, terms: Sequence[Any], angle: Any, number: Any) -> list:
    """Return term n of the waves from term n - 1, for a mesh phase that grows by an angle.

    d/dt of cosine and sine are -w sine and w cosine: term n is that of n - 1 times w / n.
    """
    inverse = w.builder.fdiv(DOUBLE(1.0), w.builder.sitofp(number, DOUBLE))
    share = w.times(angle, w.splat(inverse))
    found = []
    for place, order in enumerate(provider_of(scene.model).series.orders(scene.model)):
        factor = w.times(share, w.constant(float(order)))
        cosine, sine = terms[2 * place : 2 * place + 2]
        found += [w.negative(w.times(factor, sine)), w.times(factor, cosine)]
    return found


@intrinsic
def turn(_typing, memory, slot, scene):
    """Advance the waves to the end of a piece, by their series."""
    at = series_rows_of(scene.scene)

    def generate(context, builder, signature, arguments):
        w = VectorCode(context, builder, signature, arguments)
        vector, count = w.element(0, arguments[1]), at.waves_in_all
        angle = w.times(w.load(vector, at.angle * STRIDE), w.load(vector, at.length * STRIDE))
        waves = _terms_of_waves(w, vector, at.waves, count)

        def add(number, values):
            terms = _turned(w, scene.scene, values[:count], angle, number)
            return [*terms, *map(w.add, values[count:], terms)]

        found = w.repeat(INTEGER(TERMS + 1), 1, [*waves, *waves], add)
        for row, value in enumerate(found[count:]):
            w.store(value, vector, (at.waves + row) * STRIDE)
        return context.get_dummy_value()

    return types.void(memory, types.intp, scene), generate


@intrinsic
def multiply(_typing, memory, slot, number, scene):
    """Store sum_m K_m y_(n - m) over m from 1 to n - 1, of stiffness K and gap y of each element.

    The tangent vector has gaps of its own.
    """
    at = series_rows_of(scene.scene)

    def generate(context, builder, signature, arguments):
        w = VectorCode(context, builder, signature, arguments)
        vector, number = w.element(0, arguments[1]), arguments[2]
        parts = _parts(scene.scene)
        for group in _in_groups(range(at.elements)):

            def add(term, sums, group=group):
                stiff = w.moved(vector, term, at.elements * STRIDE)
                rest = builder.sub(number, term)
                gap = w.moved(vector, rest, at.elements * STRIDE)
                factors = [w.load(stiff, (at.stiffnesses + e) * STRIDE) for e in group]
                places = [(e, part.gaps) for part in parts for e in group]
                return [
                    w.multiply_add(factors[n % len(group)], w.load(gap, (gaps + e) * STRIDE), total)
                    for n, ((e, gaps), total) in enumerate(zip(places, sums, strict=True))
                ]

            nothing = [w.constant(0.0)] * (len(group) * len(parts))
            sums = iter(w.repeat(number, 1, nothing, add))
            for part in parts:
                for e in group:
                    w.store(next(sums), vector, (part.sums + e) * STRIDE)
        return context.get_dummy_value()

    return types.void(memory, types.intp, types.intp, scene), generate


@intrinsic
def find_ends(_typing, memory, slot, scene):
    """Store value, slope and bend of every gap at the end of a piece; see `SeriesRows.ends`."""
    at = series_rows_of(scene.scene)

    def generate(context, builder, signature, arguments):
        w = VectorCode(context, builder, signature, arguments)
        vector = w.element(0, arguments[1])
        length = w.load(vector, at.length * STRIDE)
        for group in _in_groups(range(at.elements)):

            def add(passed, values, group=group):
                number = builder.sub(INTEGER(TERMS - 1), passed)
                terms = w.moved(vector, number, at.elements * STRIDE)
                bend = w.splat(bend_of(builder, number))
                found = []
                for n, e in enumerate(group):
                    value, slope, bent = values[3 * n : 3 * n + 3]
                    term = w.load(terms, (at.gaps + e) * STRIDE)
                    found += [
                        w.multiply_add(value, length, term),
                        w.multiply_add(slope, length, value),
                        w.multiply_add(bent, length, w.times(bend, w.size(term))),
                    ]
                return found

            nothing = [w.constant(0.0)] * (3 * len(group))
            found = w.repeat(INTEGER(TERMS), 0, nothing, add)
            for n, e in enumerate(group):
                value, slope, bent = found[3 * n : 3 * n + 3]
                # The sum of the bends is a polynomial whose lowest power is the fourth.
                scaled = [value, w.times(slope, length), bent]
                for row, one in enumerate(scaled):
                    w.store(one, vector, (at.ends + 3 * e + row) * STRIDE)
        return context.get_dummy_value()

    def bend_of(builder, number):
        n = builder.sitofp(number, DOUBLE)
        product = n
        for less in (1.0, 2.0, 3.0):
            product = builder.fmul(product, builder.fsub(n, DOUBLE(less)))
        return product

    return types.void(memory, types.intp, scene), generate


@intrinsic
def advance(_typing, memory, slot, scene):
    """Advance state and tangent vector by the length of a piece."""
    at = series_rows_of(scene.scene)

    def generate(context, builder, signature, arguments):
        w = VectorCode(context, builder, signature, arguments)
        vector = w.element(0, arguments[1])
        length = w.load(vector, at.length * STRIDE)
        for part in _parts(scene.scene):
            for group in _in_groups(range(at.coordinates)):
                last = [
                    w.load(vector, (part.series + TERMS * at.coordinates + c) * STRIDE)
                    for c in group
                ]

                def add(passed, values, group=group, part=part):
                    number = builder.sub(INTEGER(TERMS - 1), passed)
                    terms = w.moved(vector, number, at.coordinates * STRIDE)
                    found = []
                    for n, c in enumerate(group):
                        value, slope = values[2 * n : 2 * n + 2]
                        term = w.load(terms, (part.series + c) * STRIDE)
                        found += [
                            w.multiply_add(value, length, term),
                            w.multiply_add(slope, length, value),
                        ]
                    return found

                begin = [one for value in last for one in (value, w.constant(0.0))]
                found = w.repeat(INTEGER(TERMS), 0, begin, add)
                for n, c in enumerate(group):
                    for row, value in enumerate(found[2 * n : 2 * n + 2]):
                        w.store(value, vector, (part.state + 2 * c + row) * STRIDE)
        return context.get_dummy_value()

    return types.void(memory, types.intp, scene), generate
