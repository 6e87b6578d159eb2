"""The report of a reproduction, in Markdown."""

from __future__ import annotations

import math
from collections.abc import Iterator
from importlib.resources import files
from string import Template

import numpy as np

from gearchaos.figures.response_lane import coordinates_of
from gearchaos.paper.comparison import NONE, Comparison, Section
from gearchaos.paper.computation import Reproduction, largest_acceleration
from gearchaos.paper.explanations import (
    hop_in_words,
    increments_in_words,
    short,
    stages_in_words,
)
from gearchaos.paper.gallery import Picture, pictures
from gearchaos.paper.our_numbers import our_numbers, pair_of
from gearchaos.paper.published import CITATION, Published
from gearchaos.paper.verdict import OVERLAP, RULES, Verdict
from gearchaos.version import software_version

TOLERANCE_UM = 11.0
"""Single pitch deviation of the driving gear in grade 7 (ISO 1328-1), in um."""

_WORDS_OF_RULES = {
    "derived": "a quantity that follows from others",
    "coefficient": "a harmonic of the mesh stiffness",
    "boundary": "the place of a boundary or of the hop",
    "amplitude": "an acceleration",
    "exponent": "an exponent",
}


def report(printed: Published, found: Reproduction, names: dict[str, str]) -> str:
    """Write the report.

    Parameters
    ----------
    printed : Published
    found : Reproduction
    names : dict of str to str
        Name of each file beside the report, with what it holds.

    Returns
    -------
    str
        Markdown, with pictures by their names.
    """
    comparison = Comparison(printed, found)
    template = files("gearchaos.paper").joinpath("report_text.md").read_text(encoding="utf-8")
    return Template(template).substitute(
        _numbers(printed, found),
        citation=CITATION,
        version=software_version(),
        rows=len(comparison.rows),
        agrees=comparison.count(Verdict.AGREES),
        in_kind=comparison.count(Verdict.IN_KIND),
        does_not=comparison.count(Verdict.DOES_NOT),
        disagreements=_disagreements(comparison),
        rules=_rules(),
        comparison="\n\n".join(_table(section) for section in comparison.sections),
        figures="\n\n".join(_figures(printed, found)),
        hop=hop_in_words(printed, found),
        increments=increments_in_words(printed, found),
        files="\n".join(f"- `{name}`: {text}" for name, text in names.items()),
    )


def _numbers(printed: Published, found: Reproduction) -> dict[str, str]:
    """Every number that the text names."""
    values = {key: number.value for key, number in printed.numbers.items()}
    ours, pair, config = our_numbers(printed, found), pair_of(found), found.config
    groups = {
        name: float(parameter.value)
        for name, parameter in found.sweep.parameters.items()
        if np.ndim(parameter.value) == 0
    }
    per_mm = values["mean_stiffness"]
    width = float(pair.face_width) * 1e3
    mass = (values["mesh_damping"] / (2.0 * values["damping_ratio"])) ** 2 / (per_mm * 1e6)
    lines = printed.contact_lines
    scale = TOLERANCE_UM * 1e-3 / groups["pitch_error_amplitude"]
    numbers = {
        "steps": found.sweep.metadata["steps_per_period"],
        "transient": config.integration.transient_periods,
        "recorded": config.integration.recorded_periods,
        "omega": values["frequency"],
        "inverse_omega": 1.0 / values["frequency"],
        "printed_period": values["mesh_period"],
        "printed_contact_ratio": values["total_contact_ratio"],
        "printed_damping_ratio": values["damping_ratio"],
        "printed_damping": values["mesh_damping"],
        "mesh_frequency": groups["mesh_frequency"],
        "contact_ratio": ours["total_contact_ratio"],
        "implied_contact_ratio": (lines.shortest + lines.longest) / 2.0,
        "shortest": lines.shortest,
        "longest": lines.longest,
        "damping_ratio": ours["damping_ratio"],
        "frequency": ours["frequency"],
        "implied_mass": mass,
        "equivalent_mass": float(pair.equivalent_mass),
        "face_width": width,
        "whole_stiffness": per_mm * width,
        "scale": groups["stiffness_variation_scale"],
        "length_scale": scale,
        "backlash": scale * groups["half_backlash"],
    } | {f"group_{name}": value for name, value in groups.items()}
    worded = {name: f"{value:.5g}" for name, value in numbers.items()}
    return worded | {
        "crossings": config.integration.crossings,
        "printed_damping": f"{values['mesh_damping']:g}",
    }


def _disagreements(comparison: Comparison) -> str:
    lines = [
        f"- **{row.quantity}** ({row.where}): {row.published} in the paper, "
        f"{row.ours if row.ours != NONE else 'not found'} here."
        for row in comparison.rows
        if row.verdict is Verdict.DOES_NOT
    ]
    return (
        "\n".join(["Does not agree:\n", *lines]) if lines else "Everything agrees at least in kind."
    )


def _rules() -> str:
    lines = [f"- {_WORDS_OF_RULES[name]}: {rule.words()}" for name, rule in RULES.items()]
    return "\n".join(
        [
            *lines,
            f"- a stage: agrees with up to {OVERLAP.agrees:.0%} {OVERLAP.measure}, in kind with up "
            f"to {OVERLAP.in_kind:.0%}",
            "- the motion at one pitch error: agrees if it is the printed one, in kind if the "
            "printed one is found from the contact flank instead, or within "
            f"{RULES['boundary'].in_kind:g} e(τ)",
            "- anything further off, or not found: does not agree",
        ]
    )


def _table(section: Section) -> str:
    head = "| | where | Pan 2021 | here | difference | verdict |\n|---|---|---|---|---|---|\n"
    rows = (
        f"| {row.quantity} | {row.where} | {row.published} | {row.ours} | {row.difference} "
        f"| {_marked(row.verdict)} |"
        for row in section.rows
    )
    return f"### {section.heading}\n\n{section.note}\n\n{head}" + "\n".join(rows)


def _marked(verdict: Verdict) -> str:
    return f"**{verdict}**" if verdict is Verdict.DOES_NOT else str(verdict)


def _figures(printed: Published, found: Reproduction) -> Iterator[str]:
    for picture in pictures():
        # In the paper's order, Table 3 stands before figure 7.
        if picture.name == "figure_07":
            yield _table_3(printed, found)
        yield f"### {picture.title}\n\n![{_alt(picture)}]({picture.name}.png)\n\n{picture.caption}"
        if picture.name == "figure_07":
            yield stages_in_words(printed, found)


def _alt(picture: Picture) -> str:
    return picture.caption.split(":")[0].split(";")[0].replace("*", "")


def _table_3(printed: Published, found: Reproduction) -> str:
    response = found.response
    lines = []
    for name in coordinates_of(response):
        before, after = (largest_acceleration(response, p, name) for p in (0.0, 1.0))
        theirs = printed.numbers["added_acceleration"].value if name == "delta_5" else NONE
        wording = response.attributes(f"{name}_acceleration")["long_name"]
        lines.append(
            f"| {wording} | {short(before)} | {short(after)} | {_signed_short(after - before)} "
            f"| {theirs} |"
        )
    return (
        "### Table 3\n\nLargest acceleration without and with one pitch error, dimensionless, and "
        "what the error adds. Only the torsional entry of the paper is compared.\n\n"
        "| | *P* = 0 | *P* = 1 | added | Pan 2021 |\n|---|---|---|---|---|\n" + "\n".join(lines)
    )


def _signed_short(value: float) -> str:
    return ("+" if value >= 0.0 or math.isnan(value) else "") + short(value)
