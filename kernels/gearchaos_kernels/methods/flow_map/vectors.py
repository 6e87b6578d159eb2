"""The arithmetic of flow maps as explicit vectors of eight, because LLVM does not vectorise it.

Maps and switch terms are applied to eight lanes at once, with the same map for all of them
(`move`). For the only lane of a block, vectors run along the state instead: its map is a sum of
columns (`_combination`).

Where maps are made on demand, there are more than two elements, and often many states. Their code
is then a loop over states, elements or terms, because it would be too long to compile otherwise.
"""

from collections.abc import Iterator, Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.cgutils import for_range
from numba.extending import intrinsic

from gearchaos_kernels.memory.rows import (
    BRANCH,
    STATE,
    STRIDE,
    VECTOR,
    control_rows_of,
    rows_of,
)
from gearchaos_kernels.memory.vector_code import DOUBLE, FLAGS, INTEGER, VectorCode
from gearchaos_kernels.methods.flow_map.layout import TERMS, aside_of, layout_of, method_rows_of
from gearchaos_kernels.recorders.loads import SIGNAL_ROWS, accumulated_of
from gearchaos_kernels.scene import Scene, provider_of


def _inputs(scene: Scene) -> list[int]:
    """Return the rows of the factors of a map: state before the step, inputs and offsets."""
    place, before, forced = layout_of(scene), rows_of(scene).state_before, method_rows_of(scene)
    return [before + n for n in range(place.states)] + [
        forced.inputs + n for n in range(place.columns - place.states)
    ]


def _tangent_inputs(scene: Scene) -> list[int]:
    """Return the rows of the tangent vector before the step, and of what varies its input."""
    first = rows_of(scene).tangent_before
    varied = [control_rows_of(scene).varied] if scene.control else []
    return [*range(first, first + layout_of(scene).states), *varied]


class _Writer(VectorCode):
    """Generates the instructions of one function of flow maps."""

    def suspects(self, sums: Any, element: Any) -> Any:
        """Return the mask of the lanes in which an element is a suspect; see `Rows.suspect`."""
        numbers = self.builder.fptoui(sums, ir.VectorType(INTEGER, VECTOR))
        bit = self.splat(self.builder.shl(INTEGER(1), element), of=INTEGER)
        found = self.builder.and_(numbers, bit)
        return self.builder.icmp_unsigned("!=", found, ir.Constant(found.type, None))

    def on_branches(self, number: Any, engaged: Sequence[Any]) -> Any:
        """Return the mask of those of eight lanes that are on a set of branches.

        ``number``: the bits of the set, 0 for an engaged element; ``engaged``: for each element
        whether it is engaged, 1 or 0.
        """
        mask = None
        for element, there in enumerate(engaged):
            bit = self.builder.and_(number, INTEGER(1 << element))
            apart = self.builder.icmp_unsigned("!=", bit, INTEGER(0))
            expected = self.builder.select(apart, self.constant(0.0), self.constant(1.0))
            those = self.builder.fcmp_ordered("==", there, expected)
            mask = those if mask is None else self.builder.and_(mask, those)
        return mask

    def slopes(
        self, terms: list[Any], powers: dict[int, Any], integrals: list[Any], deviates: bool
    ) -> Iterator[Any]:
        """Yield the integrals of the slope of a polynomial times s^k, one for each of its terms.

        ``deviates``: whether the value of the polynomial at the end, times s^k, is subtracted.
        """
        scaled = [(j, self.constant(float(j))) for j in range(1, TERMS)]
        slope = [self.builder.fmul(terms[j], factor, flags=FLAGS) for j, factor in scaled]
        value = self.sum(enumerate(terms), [powers[j] for j in range(TERMS)])
        end = self.builder.fneg(value)
        for k in range(TERMS):
            total = self.sum(enumerate(slope), integrals[k:])
            yield self.multiply_add(end, powers[k], total) if deviates else total


@intrinsic
def keep_before(_typing, memory, slot, scene):
    """Copy state and tangent vector of eight lanes before a step."""
    place, at = layout_of(scene.scene), rows_of(scene.scene)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        vector = w.element(0, arguments[1])
        for first in (STATE,) if scene.scene.tangent is None else (STATE, at.tangent):
            for line in range(first, first + place.states):
                w.store(w.load(vector, line * STRIDE), vector, (at.before + line) * STRIDE)
        return context.get_dummy_value()

    return types.void(memory, types.intp, scene), generate


@intrinsic
def bound_bends(_typing, memory, slot, maps, maps_at, scene):
    """Store by how much the gaps of eight lanes may deviate from their cubics in a step."""
    place, margins = layout_of(scene.scene), method_rows_of(scene.scene).margins

    def apply(w, vector, branch_maps, mask):
        header = w.builder.gep(branch_maps, [INTEGER(-place.header)])
        sizes = [w.size(given) for given in w.rows(vector, _inputs(scene.scene))]
        with for_range(w.builder, INTEGER(place.elements)) as loop:
            bounds = w.moved(header, loop.index, place.bound_size)
            bends = [w.spread(bounds, place.bounds + column) for column in range(len(sizes))]
            value = w.sum(enumerate(bends), sizes)
            w.put(value, w.moved(vector, loop.index, STRIDE), margins, mask)

    given = memory, types.intp, maps, types.intp, scene
    if place.on_demand:
        return types.void(*given), _on_branches(scene.scene, apply)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        vector, numbers = w.element(0, arguments[1]), w.element(2, arguments[3])
        if scene.scene.resolved is not None:
            sizes = [w.size(given) for given in w.rows(vector, _inputs(scene.scene))]
            for element in range(place.elements):
                first = place.bounds + element * place.bound_size
                bends = [w.spread(numbers, first + column) for column in range(len(sizes))]
                w.store(w.sum(enumerate(bends), sizes), vector, (margins + element) * STRIDE)
        return context.get_dummy_value()

    return types.void(*given), generate


def _on_branches(scene: Scene, apply: Any) -> Any:
    """Return the body of an intrinsic that applies the maps of their branches to eight lanes.

    ``apply(writer, vector, branch_maps, mask)`` is called for each set of branches on which any of
    the lanes is. It receives the addresses of the lanes and of the maps, and the mask of the lanes
    on these branches, None for all.
    """
    place, first = layout_of(scene), rows_of(scene).branches
    if place.on_demand:
        return _on_own_maps(scene, apply)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        vector = w.element(0, arguments[1])
        maps = builder.add(arguments[3], INTEGER(place.header))
        if place.branches == 1:
            apply(w, vector, w.element(2, maps), None)
            return context.get_dummy_value()

        # One copy per set takes LLVM many times as long, and does not run faster.
        with for_range(builder, INTEGER(place.branches)) as loop:
            engaged = [w.load(vector, (first + BRANCH * n) * STRIDE) for n in range(place.elements)]
            mask = w.on_branches(loop.index, engaged)
            with builder.if_then(w.any(mask)):
                at = builder.add(maps, builder.mul(loop.index, INTEGER(place.size)))
                apply(w, vector, w.element(2, at), mask)
        return context.get_dummy_value()

    return generate


def _on_own_maps(scene: Scene, apply: Any) -> Any:
    """Return the same body as `_on_branches` where lanes know the place of their maps.

    All lanes with the place of the first one are served, then those with the place of the first one
    left, and so on.
    """
    place, row = layout_of(scene), method_rows_of(scene).maps

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        vector = w.element(0, arguments[1])
        places = w.load(vector, row * STRIDE)
        every = ir.IntType(VECTOR)(2**VECTOR - 1)
        waiting = builder.alloca(every.type)
        builder.store(every, waiting)
        body, done = builder.append_basic_block(), builder.append_basic_block()
        builder.branch(body)
        builder.position_at_end(body)
        left = builder.load(waiting)
        lane = builder.zext(builder.cttz(left, ir.IntType(1)(1)), INTEGER)
        own = builder.load(builder.gep(vector, [builder.add(lane, INTEGER(row * STRIDE))]))
        mask = builder.fcmp_ordered("==", places, w.splat(own))
        left = builder.and_(left, builder.not_(w.bits(mask)))
        builder.store(left, waiting)
        at = builder.add(arguments[3], builder.fptosi(own, INTEGER))
        apply(w, vector, w.element(2, builder.add(at, INTEGER(place.header))), mask)
        builder.cbranch(builder.icmp_unsigned("!=", left, left.type(0)), body, done)
        builder.position_at_end(done)
        return context.get_dummy_value()

    return generate


@intrinsic
def move(_typing, memory, slot, maps, maps_at, scene):
    """Apply the map of its branches to each of eight lanes, state and tangent vector."""
    place, at = layout_of(scene.scene), rows_of(scene.scene)
    # The columns of states and elements that act on nothing else are zero in all other rows.
    model = provider_of(scene.scene.model)
    states, elements = model.maps.apart(scene.scene.model)
    columns = {*states, *(place.states + 1 + element for element in elements)}

    def inputs_of(w, vector):
        given = {STATE: w.rows(vector, _inputs(scene.scene))}
        if scene.scene.tangent is not None:
            given[at.tangent] = w.rows(vector, _tangent_inputs(scene.scene))
        return given

    def apply(w, vector, branch_maps, mask):
        given = inputs_of(w, vector)
        if place.on_demand:
            with for_range(w.builder, INTEGER(place.states)) as loop:
                line_maps = w.moved(branch_maps, loop.index)
                line_of_lanes = w.moved(vector, loop.index, STRIDE)
                compute(w, given, line_maps, range(place.columns), (line_of_lanes, mask))
            return
        for line in range(place.states):
            acting = [n for n in range(place.columns) if line in states or n not in columns]
            lines = w.builder.gep(branch_maps, [INTEGER(line)])
            line_of_lanes = w.builder.gep(vector, [INTEGER(line * STRIDE)])
            compute(w, given, lines, acting, (line_of_lanes, mask))

    def compute(w, given, line_maps, acting, lanes):
        factors = [(column, w.spread(line_maps, column * place.width)) for column in acting]
        for target, inputs in given.items():
            value = w.sum([one for one in factors if one[0] < len(inputs)], inputs)
            w.put(value, lanes[0], target, lanes[1])

    given = memory, types.intp, maps, types.intp, scene
    return types.void(*given), _on_branches(scene.scene, apply)


@intrinsic
def compute_gaps(_typing, aside, slot, maps, maps_at, scene):
    """Store the terms of the gaps of eight lanes along the step, without their constant parts.

    Where maps are made on demand, those of suspects only.
    """
    place, at = layout_of(scene.scene), aside_of(scene.scene)
    suspect = rows_of(scene.scene).suspect

    def apply(w, vector, branch_maps, mask):
        given = {0: w.rows(vector, _inputs(scene.scene))}
        if scene.scene.tangent is not None:
            given[at.tangent_terms] = w.rows(vector, _tangent_inputs(scene.scene))
        gaps = w.builder.gep(branch_maps, [INTEGER(place.gap)])
        rows = w.builder.gep(vector, [INTEGER(at.gaps * STRIDE)])
        if place.on_demand:
            with for_range(w.builder, INTEGER(place.elements)) as loop:
                suspects = w.suspects(w.load(vector, suspect * STRIDE), loop.index)
                with w.builder.if_then(w.any(w.builder.and_(suspects, mask))):
                    terms = w.moved(gaps, loop.index, place.columns * TERMS)
                    first = w.moved(rows, loop.index, at.gap_rows * STRIDE)
                    with for_range(w.builder, INTEGER(TERMS)) as term:
                        row = w.moved(first, term.index, STRIDE)
                        compute(w, given, w.moved(terms, term.index), (row, mask))
            return
        for element in range(place.elements):
            for term in range(TERMS):
                terms = w.builder.gep(gaps, [INTEGER(element * place.columns * TERMS + term)])
                row = w.builder.gep(rows, [INTEGER((element * at.gap_rows + term) * STRIDE)])
                compute(w, given, terms, (row, mask))

    def compute(w, given, terms, lanes):
        factors = [(column, w.spread(terms, column * TERMS)) for column in range(place.columns)]
        for target, inputs in given.items():
            w.put(w.sum(factors[: len(inputs)], inputs), lanes[0], target, lanes[1])

    given = aside, types.intp, maps, types.intp, scene
    return types.void(*given), _on_branches(scene.scene, apply)


@intrinsic
def add_switch(_typing, aside, slot, maps, maps_at, scene):
    """Transfer eight lanes to their new branches, at the beginning of the step.

    State and tangent vector change by the integral of the switch terms of the new branch times the
    gap, from -1 to the moment of crossing: sum_k p_k times the integrals of `sum_along`. Dampers
    that act in contact only have terms and integrals of their own.
    """
    place, at, block = layout_of(scene.scene), aside_of(scene.scene), rows_of(scene.scene)

    def apply(w, vector, branch_maps, mask):
        parts = [place.switch, place.damper] if place.damper < place.signal else [place.switch]
        count = TERMS * len(parts)
        given = {block.state_before: w.rows(vector, range(at.sums, at.sums + count))}
        if scene.scene.tangent is not None:
            sums = range(at.tangent_sums, at.tangent_sums + count)
            given[block.tangent_before] = w.rows(vector, sums)
        if place.on_demand:
            elements = w.load(vector, at.element * STRIDE)
            with for_range(w.builder, INTEGER(place.elements)) as loop:
                number = w.splat(w.builder.sitofp(loop.index, DOUBLE))
                those = w.builder.and_(mask, w.builder.fcmp_ordered("==", elements, number))
                with w.builder.if_then(w.any(those)):
                    terms = w.moved(branch_maps, loop.index, TERMS * place.width)
                    with for_range(w.builder, INTEGER(place.states)) as line:
                        row = w.moved(vector, line.index, STRIDE)
                        add(w, given, (w.moved(terms, line.index), parts), (row, those))
            return
        for element in range(place.elements):
            those = mask
            if place.elements > 1:
                those = w.builder.and_(mask, w.equal(vector, at.element, float(element)))
            for line in range(place.states):
                terms = w.builder.gep(branch_maps, [INTEGER(element * TERMS * place.width + line)])
                row = w.builder.gep(vector, [INTEGER(line * STRIDE)])
                add(w, given, (terms, parts), (row, those))

    def add(w, given, maps, lanes):
        terms, parts = maps
        starts = [part + k * place.width for part in parts for k in range(TERMS)]
        factors = [(k, w.spread(terms, start)) for k, start in enumerate(starts)]
        for target, sums in given.items():
            before = w.load(lanes[0], target * STRIDE)
            value = w.builder.fadd(before, w.sum(factors, sums), flags=FLAGS)
            w.put(value, lanes[0], target, lanes[1])

    given = aside, types.intp, maps, types.intp, scene
    return types.void(*given), _on_branches(scene.scene, apply)


@intrinsic
def sum_along(_typing, aside, scene):
    """Store the integrals of gap times s^k from -1 to the moment of crossing, for eight lanes.

    For every k this is the sum over the terms j of the gap times the integral of s^(j + k). For
    dampers that act in contact only it is the same with the rate of the gap, which is twice its
    slope. Their force jumps at the crossing, whose moment varies along a tangent vector z by
    -n z / slope: this subtracts 2 n z s^k at the crossing.
    """
    place, at = layout_of(scene.scene), aside_of(scene.scene)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        vector = w.element(0, INTEGER(0))
        after, factor, edge = w.rows(vector, (at.after, at.factor, at.edge))
        powers, integrals = {0: w.constant(1.0), 1: after}, []
        for n in range(1, 2 * TERMS):
            if n > 1:
                powers[n] = builder.fmul(powers[n // 2], powers[n - n // 2])
            begin = w.constant(-((-1.0) ** n) / n)
            integrals.append(w.multiply_add(powers[n], w.constant(1.0 / n), begin))
        given = {0: at.sums}
        if scene.scene.tangent is not None:
            given[at.tangent_terms] = at.tangent_sums
        for source, target in given.items():
            terms = w.rows(vector, range(at.gaps + source, at.gaps + source + TERMS))
            for element in range(1, place.elements):
                first = at.gaps + element * at.gap_rows + source
                others = w.rows(vector, range(first, first + TERMS))
                those = w.equal(vector, at.element, float(element))
                terms = [builder.select(those, *pair) for pair in zip(others, terms, strict=True)]
            if source == 0:
                terms[0] = builder.fsub(terms[0], edge, flags=FLAGS)
            for k in range(TERMS):
                value = w.sum(enumerate(terms), integrals[k:])
                w.put(builder.fmul(value, factor, flags=FLAGS), vector, target + k, None)
            if place.damper < place.signal:
                twice = builder.fmul(factor, w.constant(2.0), flags=FLAGS)
                for k, value in enumerate(w.slopes(terms, powers, integrals, source != 0)):
                    rate = builder.fmul(value, twice, flags=FLAGS)
                    w.put(rate, vector, target + TERMS + k, None)
        return context.get_dummy_value()

    return types.void(aside, scene), generate


@intrinsic
def copy_lane(_typing, memory, slot, aside, n, scene):
    """Copy the rows that are needed to resolve crossings of a lane to slot n of memory aside."""
    place, at, forced = layout_of(scene.scene), rows_of(scene.scene), method_rows_of(scene.scene)
    model = provider_of(scene.scene.model)
    copied = [*range(at.state_before, at.state_before + place.states)]
    if scene.scene.tangent is not None:
        copied += _tangent_inputs(scene.scene)
    copied += [at.coefficients + column for column in model.gap_columns(scene.scene.model)]
    copied += range(at.branches, at.branches + BRANCH * place.elements)
    copied += [at.suspect]
    copied += range(forced.inputs, forced.inputs + place.columns - place.states)
    copied += [forced.maps] * place.on_demand
    if place.signals:
        copied += range(forced.means, forced.means + place.signals)
        first = accumulated_of(scene.scene)
        copied += range(first, first + SIGNAL_ROWS * place.signals)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        source, target = w.element(0, arguments[1]), w.element(2, arguments[3])
        for row in copied:
            at_row = [INTEGER(row * STRIDE)]
            number = builder.load(builder.gep(source, at_row))
            builder.store(number, builder.gep(target, at_row))
        return context.get_dummy_value()

    return types.void(memory, types.intp, aside, types.intp, scene), generate


@intrinsic
def margins_of(_typing, memory, slot, scene):
    """Return by how much each gap of a lane may deviate from its cubic, a tuple."""
    first, count = method_rows_of(scene.scene).margins, layout_of(scene.scene).elements
    margins = types.UniTuple(types.float64, count)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        lane = w.element(0, arguments[1])
        found = [
            builder.load(builder.gep(lane, [INTEGER((first + element) * STRIDE)]))
            for element in range(count)
        ]
        return context.make_tuple(builder, margins, found)

    return margins(memory, types.intp, scene), generate


def _combination(forced: bool) -> Any:
    """Return an intrinsic that sums the columns of a map times their factors, for one lane.

    ``forced``: whether it includes the columns of inputs and offsets; those of a tangent vector
    end with the steady input, if a controller varies it.
    """

    @intrinsic
    def combine(_typing, numbers, target, inputs, maps, maps_at, scene):
        place = layout_of(scene.scene)
        columns = range(place.columns if forced else len(_tangent_inputs(scene.scene)))

        def generate(context, builder, signature, arguments):
            w = _Writer(context, builder, signature, arguments)
            result, given = w.element(0, arguments[1]), w.element(0, arguments[2])
            map_ = w.element(3, arguments[4])
            for first in range(0, place.width, VECTOR):
                size = min(VECTOR, place.width)
                factors = [w.spread(given, column, size) for column in columns]
                terms = [w.load(map_, column * place.width + first, size) for column in columns]
                w.store(w.sum(enumerate(factors), terms), result, first)
            return context.get_dummy_value()

        return types.void(numbers, types.intp, types.intp, maps, types.intp, scene), generate

    return combine


end_of = _combination(forced=True)
"""Compute the state at the end of a step; arguments: array, places of result and factors in it,
maps, their place, scene."""

tangent_end_of = _combination(forced=False)
"""Compute the tangent vector at the end of a step, with the same arguments."""
