"""What the report explains in sentences, from what was computed: stages, hop, increments."""

from collections import Counter
from itertools import pairwise

import numpy as np

from gearchaos.figures.labels import short
from gearchaos.paper.comparison import signed
from gearchaos.paper.computation import Reproduction, lane_of
from gearchaos.paper.hop import STARTS
from gearchaos.paper.published import published
from gearchaos.paper.stages import OUT_OF_TURN, TWO_BANDS, motions_between, out_of_turn
from gearchaos.results.result import Result


def stages_in_words(found: Reproduction) -> str:
    """Tell what lies in the stages that the paper calls chaotic or by a name of its own."""
    texts, lanes = [], found.labelled(found.sweep)
    for stage in published().stages:
        if stage.printed != stage.motion or stage.motion == "chaotic":
            counts = Counter(motions_between(lanes, stage.first, stage.last))
            worded = ", ".join(f"{count} {label}" for label, count in counts.most_common(6))
            texts.append(
                f'In the paper\'s stage "{stage.printed}", {stage.first:g} to {stage.last:g} e(τ), '
                f"the {counts.total()} lanes of the sweep are: {worded}."
            )
    texts.append(_third_stage_in_words(found))
    last = published().stages[-1]
    escaped = motions_between(lanes, last.first, last.last).count("period 1")
    if escaped:
        texts.append(
            f"Towards the end of the sweep chaos is transient: {escaped} lanes have escaped to a "
            "coexisting motion of period 1."
        )
    return " ".join(texts)


def _third_stage_in_words(found: Reproduction) -> str:
    """Tell how the bands merge, where the attractor widens at once, and what its exponents are."""
    lanes, crisis = found.labelled(found.sweep), found.crisis
    on_two = lanes.labels == TWO_BANDS
    if crisis is None or not on_two.any():
        return "No motion on two bands was found that a crisis ends."
    shares = out_of_turn(found.sweep["section_delta_5"])
    apart, last = (lanes.values[on_two & (shares <= most)].max() for most in (0.0, OUT_OF_TURN))
    lowest, highest = (signed(f(lanes.exponent[on_two]), 3) for f in (np.min, np.max))
    return (
        f"Up to {apart:.2f} e(τ) the two bands are visited strictly in turn; then they touch, and "
        f"some points, {shares[on_two].max():.0%} of them at most, follow one from the same side, "
        f"up to the last lane on two bands, {last:.2f}. An interior crisis ends it: the section, "
        f"no wider than {crisis.before:.2f} up to there, spans {crisis.after:.2f} at once at "
        f"{crisis.value:.2f}. The exponents of the lanes on two bands go from {lowest} to "
        f"{highest}: those of periodic motions, and of chaos then. The paper's are about zero."
    )


def hop_in_words(found: Reproduction) -> dict[str, str]:
    """Word what the report says of the hop: where motions coexist and starts change over."""
    hop, paper = found.hop, published().numbers["hop"].value
    starts = [
        f"a start {'on the ' if kind == 'contact' else ''}{STARTS[kind]} changes between "
        f"{change.before:.3f} and {change.after:.3f}"
        + (f" (and {change.returns} times back)" if change.returns else "")
        for kind, change in hop.changes.items()
    ]
    upper, lower = (
        float(sweep["crossings_per_period"][lane_of(sweep, paper)])
        for sweep in (hop.upwards, hop.downwards)
    )
    parting = ": on the one the teeth never part, on the other they do"
    falls, rises = (loss.name.lower().replace("_", " ") for loss in hop.losses)
    share, rest = hop.share(paper), hop.changes["rest"]
    inside = f"inside the interval, at {share:.0%} of it"
    exponents = [signed(exponent, 5) for exponent in (*found.exponents, *rest.exponents)]
    before = found.sweep["lyapunov_exponent"][found.sweep[found.sweep.axis] <= rest.before]
    return {
        "falls": falls,
        "rises": rises,
        "upper": f"{upper:g}",
        "lower": f"{lower:g}{parting if upper == 0.0 < lower else ''}",
        "starts": "; ".join(starts),
        "place": inside if 0.0 <= share <= 1.0 else "outside of the interval",
        **dict(zip(("ten_before", "ten_after", "six_before", "six_after"), exponents, strict=True)),
        "theirs": signed(published().numbers["hop_exponent_before"].value, 4),
        "spread": f"{np.ptp(before):.0e}",
    }


def increments_in_words(found: Reproduction) -> str:
    """Tell why the increments of figure 14 are even, and of what they are."""
    response, steps = found.response, published().increments.pitch_errors
    omega, amplitude = found.group("mesh_frequency"), found.group("pitch_error_amplitude")
    motions = [response["delta_5_acceleration"][lane_of(response, p)] for p in steps]
    magnitude = [float(np.max(np.abs(motion))) for motion in motions]
    grown = ", ".join(short(b - a) for a, b in pairwise(magnitude))
    apart = [p for p in steps if _largest_while_apart(response, lane_of(response, p))]
    if len(apart) < 2:
        return f"The largest magnitudes of the torsional acceleration grow by {grown}."
    return (
        f"**Why the increments are even.** The largest torsional acceleration at {apart[0]:g} e(τ) "
        "and more falls into the time in which the teeth are apart. There δ<sub>5</sub>″ = "
        "f<sub>n</sub> + Ω² *P* e<sub>r</sub> sin Ωτ, but for damping: two e(τ) more add 2 Ω² "
        f"e<sub>r</sub> = {short(2.0 * omega**2 * amplitude)}, whatever the motion. The first "
        "increment spans the hop. This holds for the largest *signed* acceleration, as which "
        f'"amplitude" is read; the largest magnitudes grow by {grown}, not at all as printed.'
    )


def _largest_while_apart(response: Result, lane: int) -> bool:
    at = int(np.argmax(response["delta_5_acceleration"][lane]))
    meanings = response.variables["contact_tangential"].flags
    return meanings[int(response["contact_tangential"][lane][at])] == "apart"
