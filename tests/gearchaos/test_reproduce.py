"""The gallery: rules of verdicts, a single copy of the printed numbers, a self-contained report."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from gearchaos import FileError, load_config, open_result
from gearchaos.command_line import SWEEPS
from gearchaos.figures.response import coordinates_of
from gearchaos.models.gear_pair.contact_lines import series_table
from gearchaos.paper.comparison import (
    AGREEMENT_RULES,
    WINDOW,
    Agreement,
    compare,
    counterparts,
    motion_verdict,
    overlap_verdict,
)
from gearchaos.paper.comparison import (
    verdict as verdict_of,
)
from gearchaos.paper.computation import compute_gallery, lane_of, largest_acceleration
from gearchaos.paper.gallery import KINDS, check_folder, pictures, write_gallery
from gearchaos.paper.published import contact_line_stiffness, printed_coefficients, published
from gearchaos.paper.stages import OUT_OF_TURN, out_of_turn
from gearchaos.results.reading.stage_table import stage_table

from .commands import run_module

AGREES, IN_KIND, DOES_NOT = Agreement
COARSE = (
    "integration.transient_periods=100",
    "integration.recorded_periods=200",
    "outputs.section_points=48",
)
CLONE = Path(__file__).resolve().parents[2]


def tables(text: str) -> dict[str, list[list[str]]]:
    """Return the cells of every Markdown table by heading, without the heads of the tables."""
    found: dict[str, list[list[str]]] = {}
    heading, head = "", True
    for line in text.splitlines():
        if line.startswith("#"):
            heading = line.lstrip("# ")
        elif line.startswith("|---"):
            head = False
        elif not line.startswith("|"):
            head = True
        elif not head:
            cells = [cell.strip() for cell in line.strip("|").split(" | ")]
            found.setdefault(heading, []).append(cells)
    return found


def numbers(text: str | list[str]) -> list[float]:
    """Return all complete numbers of one or several cells."""
    joined = text if isinstance(text, str) else " | ".join(text)
    plain = joined.replace("−", "-")
    return [
        float(number) for number in re.findall(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e-?\d+)?", plain)
    ]


@pytest.mark.parametrize(
    ("ours", "verdict"),
    [(10.0, AGREES), (10.5, AGREES), (9.4, IN_KIND), (12.5, IN_KIND), (7.4, DOES_NOT)],
)
def test_a_relative_rule_judges_by_shares_of_the_printed_number(ours, verdict):
    assert verdict_of(AGREEMENT_RULES["amplitude"], 10.0, ours) is verdict
    assert verdict_of(AGREEMENT_RULES["amplitude"], -10.0, -ours) is verdict


def test_a_relative_rule_distinguishes_signs():
    assert verdict_of(AGREEMENT_RULES["exponent"], -0.0043, 0.0043) is DOES_NOT


def test_small_harmonics_are_judged_by_the_first_one():
    rule = AGREEMENT_RULES["coefficient"]
    assert verdict_of(rule, 1e-4, 0.0) is DOES_NOT
    assert verdict_of(rule, 1e-4, 0.0, size=1.7) is AGREES


@pytest.mark.parametrize(
    ("ours", "verdict"), [(1.22, AGREES), (1.23, IN_KIND), (1.62, IN_KIND), (1.63, DOES_NOT)]
)
def test_a_boundary_is_judged_by_its_distance(ours, verdict):
    assert verdict_of(AGREEMENT_RULES["boundary"], 1.12, ours) is verdict


@pytest.mark.parametrize("rule", AGREEMENT_RULES.values())
def test_what_was_not_found_does_not_agree(rule):
    assert verdict_of(rule, 1.0, math.nan) is DOES_NOT
    assert 0.0 < rule.agrees < rule.in_kind


@pytest.mark.parametrize(
    ("span", "verdict"),
    [((0.0, 10.0), AGREES), ((0.5, 10.0), AGREES), ((2.0, 12.0), IN_KIND), ((9.0, 11.0), DOES_NOT)],
)
def test_a_stage_is_judged_by_what_is_common(span, verdict):
    assert overlap_verdict((0.0, 10.0), span) is verdict
    assert overlap_verdict(span, (0.0, 10.0)) is verdict


def test_stages_apart_do_not_agree():
    assert overlap_verdict((0.0, 1.0), (2.0, 3.0)) is DOES_NOT


def test_the_motion_at_one_pitch_error():
    assert motion_verdict("chaotic", "chaotic", ()) is AGREES
    assert motion_verdict("chaotic", "period 1", ("chaotic",)) is IN_KIND
    assert motion_verdict("chaotic", "period 1", ("period 2",)) is DOES_NOT


def test_the_configuration_and_the_printed_numbers_say_the_same():
    printed = published()
    numbers = {key: number.value for key, number in vars(printed.numbers).items()}
    for name in ("pan2021.toml", "pan2021_full.toml", "pan2021_first.toml"):
        config = load_config(SWEEPS / name)
        assert config.mesh.mean_stiffness_N_per_um_mm == numbers["mean_stiffness"]
        assert config.mesh.stiffness.cosine_N_per_um_mm == (*printed.harmonics.cosine,)
        assert config.mesh.stiffness.sine_N_per_um_mm == (*printed.harmonics.sine,)
        groups = config.groups.given()
        assert groups["mesh_frequency"] == pytest.approx(2.0 * np.pi * numbers["frequency"])
        ends = config.sweep.from_, config.sweep.to
        assert ends == (printed.stages[0].first, printed.stages[-1].last)
    # Only the first set takes the printed damping as that of the whole face width.
    assert groups["damping_ratio"] == pytest.approx(numbers["damping_ratio"] / np.sqrt(15.0))


def test_the_documentation_and_the_printed_numbers_say_the_same():
    text = (CLONE / "docs" / "model.md").read_text(encoding="utf-8")
    rows = {row[0]: row[1:] for table in tables(text).values() for row in table}
    printed = published()
    assert numbers(rows["$a_n$"]) == [*printed.harmonics.cosine]
    assert numbers(rows["$c_n$"]) == [*printed.harmonics.sine]
    said = {
        "driven_speed": numbers(rows["speed"])[1],
        "mean_stiffness": numbers(re.search(r"about \$k_m = ([^$]+)\$", text)[1])[0],
        "mesh_frequency_hz": numbers(re.search(r"2\\pi\\cdot (\d+)\$ Hz", text)[1])[0],
        "total_contact_ratio": numbers(rows["Table 1"][0])[0],
        "hop": numbers(rows["jump between two period-1 motions"][0])[0],
    }
    said["frequency"], said["mesh_period"], said["spectral_peak"] = numbers(
        rows["eq. 9, sec. 3.1"][0]
    )
    said["damping_ratio"], said["mesh_damping"] = numbers(rows["sec. 2.4, eq. 21"][0])
    (exponent,) = numbers(rows["exponent at the jump"][0])
    said["hop_exponent_before"] = said["hop_exponent_after"] = exponent
    for direction, states in (("torsional", [5]), ("transverse", [1, 2]), ("axial", [3, 4])):
        added = next(row[0] for name, row in rows.items() if name.startswith(f"{direction} accel"))
        for state, value in zip(states, numbers(added), strict=True):
            said[f"added_delta_{state}"] = value
    assert said == {key: number.value for key, number in vars(printed.numbers).items()}
    increments = next(row[0] for name, row in rows.items() if name.startswith("increments"))
    assert numbers(increments) == [*printed.increments.values]
    stages = [row[1] for row in tables(text)["9. What agrees and what does not"]]
    spans = [[stage.first, stage.last] for stage in printed.stages]
    # The last stage ends at the end of the sweep.
    spans[-1].pop()
    assert [numbers(cell) for cell in stages[: len(spans)]] == spans


def test_stages_follow_one_another_and_every_rule_is_known():
    printed = published()
    for before, after in zip(printed.stages, printed.stages[1:], strict=False):
        assert after.first == pytest.approx(before.last + 0.01)
    assert {number.rule for number in vars(printed.numbers).values()} <= set(AGREEMENT_RULES)
    assert len(printed.increments.pitch_errors) == len(printed.increments.values) + 1


def test_table_2_holds_the_harmonics_of_the_contact_lines():
    ours, theirs = contact_line_stiffness().coefficients(6), printed_coefficients()
    assert np.max(np.abs(ours - theirs)) < 1e-3 * abs(theirs[0])


def test_the_fit_of_figure_4_leaves_the_trapezoid_by_its_missing_harmonics_alone():
    """Odd harmonics of a trapezoid of equal parts have the amplitude 8 sqrt(2) h / (pi n)^2."""
    trapezoid, printed = contact_line_stiffness(), printed_coefficients()
    apart = np.max(np.abs(trapezoid.table(1000) - series_table(printed, 1000)))
    harmonics = np.abs(trapezoid.coefficients(6)[::2])
    size = 8.0 * np.sqrt(2.0) * trapezoid.half_height / np.pi**2
    assert harmonics == pytest.approx(size / np.array([1.0, 9.0, 25.0]))
    missing = size * np.sum(1.0 / np.arange(7.0, 20001.0, 2.0) ** 2)
    of_table_2 = np.sum(np.abs(trapezoid.coefficients(6) - printed))
    assert size / 49.0 < apart < missing + of_table_2


@pytest.fixture(scope="module")
def found():
    """Return a gallery of few lanes and periods, for facts that do not depend on their numbers."""
    coarse = ["sweep.count=76", *COARSE]
    # The soft axial bearings cause a long transient, which is kept.
    full = load_config(SWEEPS / "pan2021_full.toml", ["sweep.count=1", *COARSE[1:]])
    return compute_gallery(
        load_config(SWEEPS / "pan2021.toml", coarse), full, hop_step=0.1, periods=8
    )


@pytest.fixture(scope="module")
def folder(found, tmp_path_factory):
    folder = tmp_path_factory.mktemp("gallery")
    write_gallery(found, folder, formats=("png",))
    return folder


def test_bands_that_take_turns_are_distinguished_from_what_does_not():
    """The logistic map has two bands up to 3.6786; at 4 the sides are as random as a fair coin."""
    rates = np.array([3.2, 3.5, 3.6, 3.67, 3.84, 4.0])
    section = [np.full(rates.size, 0.3)]
    while len(section) < 4000:
        section.append(rates * section[-1] * (1.0 - section[-1]))
    shares = out_of_turn(np.array(section[2000:]).T)
    assert shares[:4].tolist() == [0.0] * 4
    assert shares[4] == pytest.approx(1.0 / 3.0, abs=1e-3)
    # The tolerance is four standard deviations of 1999 throws.
    assert shares[5] == pytest.approx(0.5, abs=2.0 / np.sqrt(1999))


def test_what_was_printed_is_of_three_kinds():
    printed = published()
    kinds = [number.kind for number in vars(printed.numbers).values()]
    kinds += [printed.harmonics.kind, printed.increments.kind, *vars(printed.kinds).values()]
    kinds.append(printed.boundaries.kind)
    assert {*kinds} == {*KINDS}


@pytest.mark.slow
def test_every_printed_number_is_compared(found):
    printed = published()
    assert found.numbers.keys() == vars(printed.numbers).keys()
    rows = [row for table in compare(found).values() for row in table]
    harmonics = len(printed.harmonics.cosine) + len(printed.harmonics.sine)
    spans = len(printed.stages) + (len(printed.stages) - 1) + len(printed.motions)
    assert len(rows) == len(vars(printed.numbers)) + harmonics + spans + len(
        printed.increments.values
    )


@pytest.mark.slow
def test_derived_numbers_follow_from_table_1(found):
    ours, pair = found.numbers, found.pair
    assert ours["driven_speed"] == pytest.approx(2000.0 * 21 / 38)
    assert ours["mesh_frequency_hz"] == pytest.approx(700.0)
    assert ours["mesh_period"] == pytest.approx(1.0 / 0.1394)
    omega_h = np.sqrt(13.3548e9 * 0.015 / pair.equivalent_mass)
    assert ours["frequency"] == pytest.approx(2.0 * np.pi * 700.0 / omega_h)
    damping = 2.0 * ours["damping_ratio"] * np.sqrt(13.3548e9 * 0.015 * pair.equivalent_mass)
    assert ours["mesh_damping"] == pytest.approx(damping)


@pytest.mark.slow
def test_increments_of_separated_teeth_are_those_of_the_forcing(found):
    """While teeth are apart, delta_5'' = f_n + Omega^2 P e_r sin - cos(beta_b) 2 xi y_1'."""
    response = found.response
    group = {
        name: float(parameter.values)
        for name, parameter in response.parameters.items()
        if np.ndim(parameter.values) == 0
    }
    omega, cosine = group["mesh_frequency"], np.cos(np.radians(group["base_helix_angle_deg"]))
    for p in (3.0, 5.0, 7.0, 9.0, 11.0):
        lane = lane_of(response, p)
        at = int(np.argmax(response["delta_5_acceleration"][lane]))
        phase, error = 2.0 * np.pi * response["time"][at], p * group["pitch_error_amplitude"]
        rates = {n: response[f"delta_{n}_rate"][lane, at] for n in (1, 2, 5)}
        approach = rates[1] - rates[2] + rates[5] - omega * error * np.cos(phase) * cosine
        wanted = group["load"] + omega**2 * error * np.sin(phase)
        wanted -= cosine * 2.0 * group["damping_ratio"] * approach
        assert largest_acceleration(response, p) == pytest.approx(wanted, rel=1e-9)


@pytest.mark.slow
def test_both_motions_exist_between_the_folds_and_only_one_parts_the_teeth(found):
    hop = found.hop
    before, after = hop.changes["rest"]
    assert hop.first.above < before < after < hop.last.below
    assert hop.first.above < published().numbers.hop.value < hop.last.below
    crossings = hop.sweeps.sel(pitch_error=after, method="nearest")["crossings_per_period"]
    assert crossings[0] == 0.0 < crossings[1]


@pytest.mark.slow
def test_the_exponent_before_the_hop_is_that_of_the_sweep(found):
    """The teeth stay in contact: one linear system with periodic coefficients, at any P."""
    values = found.sweep[found.sweep.axis]
    before = found.sweep["lyapunov_exponent"][values < found.hop.changes["rest"][0]]
    assert before.size > 3
    assert before == pytest.approx(found.exponents[1][0], rel=1e-3)


@pytest.mark.slow
def test_stages_are_found_where_the_labels_are(found):
    first = counterparts(published().stages, found.lanes)[0]
    assert first is not None and first.start == 0.0
    assert found.lanes.labels[first.last] == "period 1"


@pytest.fixture(scope="module")
def report(folder):
    return (folder / "report.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_report_shows_every_figure_and_leaves_nothing_open(report, folder):
    shown = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", report)
    assert shown == [f"{name}.png" for name, *_ in pictures()]
    assert all((folder / name).read_bytes().startswith(b"\x89PNG") for name in shown)
    assert "![]" not in report and not set("${}") & set(report) and " nan" not in report


def close(cell: str, value: float, digits: int = 6) -> bool:
    """Return whether a cell, rounded to ``digits`` digits, shows a value."""
    (number,) = numbers(cell)
    return number == pytest.approx(value, rel=0.51 * 10.0 ** (1 - digits), abs=1e-12)


def contact_line_harmonics() -> np.ndarray:
    """Return the first six a_n and c_n of the contact lines, relative to the mean, from a table."""
    table = contact_line_stiffness().table(2**16)
    spectrum = 2.0 * np.fft.rfft(table)[1:7] / table.size
    return np.concatenate([spectrum.real, -spectrum.imag])


def table_2() -> list[float]:
    return [*published().harmonics.cosine, *published().harmonics.sine]


@pytest.mark.slow
def test_every_derived_number_in_the_report_is_the_computed_one(report, found):
    """Rows are identified by their names; every row and every number has a counterpart."""
    pair, response = found.pair, found.response
    force = 13.3548e9 * 0.015
    ours = {
        "speed of the driven gear": 2000.0 * 21 / 38,
        "mesh frequency": 2000.0 / 60.0 * 21,
        "total contact ratio": pair.total_contact_ratio,
        "mean mesh stiffness": np.linalg.lstsq(
            contact_line_harmonics()[:, np.newaxis], table_2(), rcond=None
        )[0][0],
        "mesh damping ratio": (xi := found.group("damping_ratio")),
        "mesh damping c": 2.0 * xi * np.sqrt(force * pair.equivalent_mass),
        "dimensionless mesh frequency": 1400.0 * np.pi / np.sqrt(force / pair.equivalent_mass),
        "mesh period": response["mesh_period"][0],
    }
    rows = tables(report)["Derived quantities"]
    assert len(rows) == len(ours)
    for row, (name, value) in zip(rows, ours.items(), strict=True):
        assert row[0].startswith(name)
        assert close(row[4], value, 4)
        share = 100.0 * (value / numbers(row[3])[0] - 1.0)
        assert numbers(row[5])[0] == pytest.approx(share, abs=0.06 if abs(share) > 1.0 else 0.006)


@pytest.mark.slow
def test_what_the_report_says_of_the_slips_follows_from_what_is_printed(report, found):
    printed, lines = published().numbers, published().contact_lines
    width, stiffness = 1e3 * found.pair.face_width, printed.mean_stiffness.value
    xi, damping = printed.damping_ratio.value, printed.mesh_damping.value
    said = {
        r"m<sub>e</sub> = (\S+) kg; Table 1": (damping / (2.0 * xi)) ** 2 / (stiffness * 1e6),
        r"stiffness of all (\S+) mm": width,
        r"smaller by the root of (\S+), 0": width,
        r"smaller by the root of \S+, (\S+)\. ": xi / np.sqrt(width),
        r"from\s+(\S+) to \S+ lengths": lines.shortest,
        r"to (\S+) lengths of a full line": lines.longest,
        r"which is ε<sub>γ</sub> = (\S+)\. ": (lines.shortest + lines.longest) / 2.0,
        r"whole face width, (\S+) N/µm": stiffness * width,
    }
    for pattern, value in said.items():
        assert close(re.search(pattern, report)[1], value, 5), pattern


@pytest.mark.slow
def test_every_harmonic_in_the_report_is_that_of_the_contact_lines(report):
    """The trapezoid has four equal parts: its corners alone determine a_n and c_n."""
    rows = tables(report)["Table 2: harmonics of the mesh stiffness"]
    names = [f"{letter}<sub>{n}</sub>" for letter in "ac" for n in range(1, 7)]
    assert [row[0] for row in rows] == names
    assert [numbers(row[3])[0] for row in rows] == pytest.approx(table_2())
    ours = 13.3548 * contact_line_harmonics()
    assert [numbers(row[4])[0] for row in rows] == pytest.approx(ours, abs=0.6e-4)


@pytest.mark.slow
def test_every_acceleration_in_the_report_is_the_largest_of_its_array(report, found):
    response = found.response
    largest = {
        p: {n: response[f"{n}_acceleration"][lane].max() for n in coordinates_of(response)}
        for lane, p in enumerate(response["pitch_error"].tolist())
    }
    torsion = [largest[p]["delta_5"] for p in sorted(largest)]
    rows = tables(report)["Table 3, figures 14 and 15: accelerations"]
    order = ("delta_5", "delta_1", "delta_2", "delta_3", "delta_4")
    added = [largest[1.0][name] - largest[0.0][name] for name in order]
    for row, grown in zip(rows[:-1], [*added, *np.diff(torsion)[1:]], strict=True):
        assert close(row[4], grown, 4)
    table_3 = dict(zip(order, (0.0113, 0.0009, 0.0007, 0.0022, 0.0019), strict=True))
    printed = [*table_3.values(), *published().increments.values, 0.1394]
    assert [numbers(row[3])[0] for row in rows] == printed
    # A motion that is forced at the mesh frequency has its highest line at this frequency.
    assert close(rows[-1][4], 1.0 / response["mesh_period"][0], 4)

    rows = tables(report)["Table 3"]
    assert [row[0] for row in rows] == [
        response.attributes(f"{name}_acceleration")["long_name"] for name in largest[0.0]
    ]
    for row, name in zip(rows, largest[0.0], strict=True):
        without, once = largest[0.0][name], largest[1.0][name]
        assert close(row[1], without, 4) and close(row[2], once, 4)
        assert close(row[3], once - without, 4)
        assert numbers(row[4]) == [table_3[name]]


@pytest.mark.slow
def test_the_hop_in_the_report_is_where_the_carried_sweeps_part(report, found):
    rows = tables(report)["Figure 7: the hop"]
    assert close(rows[0][4].removesuffix(" e(τ)"), found.hop.changes["rest"][1], 4)
    assert [numbers(row[4])[0] for row in rows[1:]] == pytest.approx(found.exponents[0], rel=1e-3)
    assert [numbers(row[3])[0] for row in rows] == [1.12, -0.0043, -0.0043]
    six = re.search(r"motion alone have (\S+) and (\S+)\.", report)
    assert [numbers(text)[0] for text in six.groups()] == pytest.approx(
        found.exponents[1], abs=6e-6
    )
    ends = re.search(r"coexist from \*P\* = (\S+), .*? to \*P\* = (\S+), where", report)
    assert [float(end) for end in ends.groups()] == pytest.approx(
        [found.hop.first.above, found.hop.last.below], abs=1e-4
    )


def labels_of(result, crisis, *, shared: bool = False) -> list[str]:
    """Return the label of every lane; motions that alternate about the median have two bands."""
    widest = (crisis.before + crisis.after) / 2.0
    meanings = result.variables["motion"].flags
    labels = []
    for kind, n, section in zip(
        result["motion"], result["period"], result["section_delta_5"], strict=True
    ):
        label = f"period {n}" if n else meanings[kind].replace("_", "-")
        turns = np.diff(np.sign(section - np.median(section))) != 0
        longer = n > 2 or label in ("chaotic", "quasi-periodic")
        on_two = longer and np.mean(turns) >= 1.0 - OUT_OF_TURN and np.ptp(section) < widest
        bands = "two bands" if shared or turns.all() else "two bands that touch"
        labels.append(bands if on_two else label)
    return labels


def ends_of(motion, lanes):
    stages = stage_table(lanes, WINDOW)
    return [(round(s.start, 2), round(s.end, 2)) for s in stages if s.label == motion]


@pytest.mark.slow
def test_every_stage_in_the_report_is_one_of_the_stage_table(report, found):
    printed, labels = published().stages, labels_of(found.sweep, found.crisis, shared=True)
    values = found.sweep["pitch_error"].round(2).tolist()
    rows = tables(report)["Figure 7: stages"]
    assert [row[0] for row in rows] == [stage.printed for stage in printed]
    firsts = []
    for row, stage in zip(rows, printed, strict=True):
        assert row[3] == f"{stage.first:.2f} – {stage.last:.2f}"
        span, _, share = row[4].partition(", in ")
        first, last = numbers(span) if span != "–" else (math.nan, math.nan)
        firsts.append(first)
        if span == "–":
            # No lane within reach has the motion.
            reach = AGREEMENT_RULES["boundary"].in_kind
            lanes = zip(values, labels, strict=True)
            assert stage.motion not in [
                label for v, label in lanes if stage.first - reach < v < stage.last + reach
            ]
            assert row[5:] == ["–", "**does not agree**"]
        else:
            # Lanes at the ends may lie in windows; all lanes outside windows have the motion.
            inside = labels[values.index(first) : values.index(last) + 1]
            own = inside.count(stage.motion) / len(inside)
            assert own > 0.5
            assert share == ("" if own == 1.0 else f"{math.floor(100.0 * own)} % of its lanes")
            assert (first, last) in ends_of(stage.motion, found.lanes)
            assert numbers(row[5]) == pytest.approx(
                [first - stage.first, last - stage.last], abs=0.006
            )
    rows = tables(report)["Figure 7: boundaries"]
    assert len(rows) == len(printed) - 1
    for row, before, first in zip(rows, firsts[:-1], firsts[1:], strict=True):
        known = math.isfinite(before) and math.isfinite(first)
        assert row[4] == (f"{first:g} e(τ)" if known else "–")


@pytest.mark.slow
def test_every_motion_in_the_report_is_the_label_of_its_lane(report, found):
    rows = tables(report)["Figures 8 to 13: the motion at six pitch errors"]
    rest = labels_of(found.motions, found.crisis)
    assert found.motions["pitch_error"].tolist() == [m.pitch_error for m in published().motions]
    for row, shown, mine in zip(rows, published().motions, rest, strict=True):
        assert row[:4] == [
            f"motion at {shown.pitch_error:g} e(τ)",
            f"figure {shown.figure}",
            "predicted",
            shown.printed,
        ]
        assert row[4] == mine


@pytest.mark.slow
def test_the_verdicts_of_the_report_are_counted(report):
    compared = [row for table in tables(report).values() for row in table if len(row) == 7]
    verdicts = [row[6].strip("*") for row in compared]
    assert set(verdicts) <= {"agrees", "agrees in kind", "does not agree"}
    counts = re.search(r"Of (\d+) printed .* (\d+) agree, (\d+) .* and (\d+) do not", report)
    assert [int(count) for count in counts.groups()] == [
        len(compared),
        *(verdicts.count(verdict) for verdict in Agreement),
    ]


@pytest.mark.slow
def test_the_report_counts_apart_what_was_derived_fitted_and_predicted(report):
    compared = [row for table in tables(report).values() for row in table if len(row) == 7]
    assert {row[2] for row in compared} == {*KINDS}
    for row, kind in zip(tables(report)["In short"], KINDS, strict=True):
        own = [r[6].strip("*") for r in compared if r[2] == kind]
        assert [int(cell) for cell in row[1:]] == [len(own), *(own.count(v) for v in Agreement)]
    # Twelve harmonics follow without any motion; six of them are zero up to rounding.
    (derived, *_), harmonics = (
        tables(report)["In short"],
        tables(report)["Table 2: harmonics of the mesh stiffness"],
    )
    zeros = sum(numbers(row[4])[0] == 0.0 for row in harmonics)
    # The 2 in the middle is the number of the table.
    assert numbers(derived[0]) == [len(harmonics), 2, zeros] == [12, 2, 6]


@pytest.mark.slow
def test_the_groups_in_the_report_are_those_of_the_sweep(report, found):
    cells = [row[1] for row in tables(report)["The identified groups"]]
    shared = found.response.parameters
    names = [
        ["load"],
        ["half_backlash"],
        ["pitch_error_amplitude"],
        ["transverse_stiffness_p", "transverse_damping_p"],
        ["transverse_stiffness_g", "transverse_damping_g"],
        ["axial_stiffness_p", "axial_damping_p"],
        ["axial_stiffness_g", "axial_damping_g"],
        ["damping_ratio"],
        ["stiffness_variation_scale"],
        ["mesh_frequency"],
        ["mass_ratio_p", "mass_ratio_g", "base_helix_angle_deg"],
    ]
    assert [numbers(cell) for cell in cells] == [
        pytest.approx([float(shared[name].values) for name in row], rel=1e-4) for row in names
    ]


@pytest.mark.slow
def test_results_lie_beside_the_report(found, folder):
    assert np.array_equal(open_result(folder / "sweep.h5")["motion"], found.sweep["motion"])
    assert "delta_4_acceleration" in open_result(folder / "accelerations.h5")


def test_the_gallery_in_the_documentation_is_whole():
    gallery = CLONE / "docs" / "gallery"
    text = (gallery / "report.md").read_text(encoding="utf-8")
    shown = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", text)
    assert shown == [f"{name}.png" for name, *_ in pictures()]
    assert all((gallery / name).is_file() for name in shown)


@pytest.mark.slow
def test_an_existing_gallery_is_kept(folder):
    with pytest.raises(FileError, match=r"report.md: exists already.*--overwrite"):
        check_folder(folder, overwrite=False)
    check_folder(folder, overwrite=True)


@pytest.mark.slow
def test_the_command_refuses_what_it_cannot_do(folder, tmp_path):
    unknown = run_module("gearchaos.reproduce", "pan2022", cwd=tmp_path)
    assert unknown.code == 2 and "pan2021" in unknown.err and not unknown.out
    kept = run_module("gearchaos.reproduce", "pan2021", "-o", str(folder), cwd=tmp_path)
    assert kept.code == 4 and "--overwrite" in kept.err and not kept.out
    (tmp_path / "file").touch()
    file = run_module("gearchaos.reproduce", "pan2021", "-o", "file", cwd=tmp_path)
    assert file.code == 4 and "is a file" in file.err
    assert not [path for path in tmp_path.iterdir() if path.name != "file"]
