"""The gallery: rules of verdicts, printed numbers kept once, and a report that stands alone."""

import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from gearchaos import FileError, load_config, open_result
from gearchaos.paper.comparison import Comparison
from gearchaos.paper.computation import compute, lane_of, largest_acceleration
from gearchaos.paper.gallery import check_folder, pictures, write_gallery
from gearchaos.paper.hop import find_hop
from gearchaos.paper.our_numbers import (
    contact_line_stiffness,
    our_numbers,
    pair_of,
    printed_series,
)
from gearchaos.paper.published import published
from gearchaos.paper.stages import counterparts, motion_at
from gearchaos.paper.sweep_files import sweep_file
from gearchaos.paper.verdict import (
    OVERLAP,
    RULES,
    Rule,
    Verdict,
    motion_verdict,
    overlap_verdict,
)

from .commands import run_module

AGREES, IN_KIND, DOES_NOT = Verdict
COARSE = (
    "integration.transient_periods=100",
    "integration.recorded_periods=200",
    "outputs.section_points=48",
)
CLONE = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    ("ours", "verdict"),
    [(10.0, AGREES), (10.5, AGREES), (9.4, IN_KIND), (12.5, IN_KIND), (7.4, DOES_NOT)],
)
def test_a_relative_rule_judges_by_shares_of_the_printed_number(ours, verdict):
    assert Rule("", 0.05, 0.25).verdict(10.0, ours) is verdict
    assert Rule("", 0.05, 0.25).verdict(-10.0, -ours) is verdict


def test_a_relative_rule_tells_signs_apart():
    assert RULES["exponent"].verdict(-0.0043, 0.0043) is DOES_NOT


def test_small_harmonics_are_judged_by_the_first_one():
    rule = RULES["coefficient"]
    assert rule.verdict(1e-4, 0.0) is DOES_NOT
    assert rule.verdict(1e-4, 0.0, size=1.7) is AGREES


@pytest.mark.parametrize(
    ("ours", "verdict"), [(1.22, AGREES), (1.23, IN_KIND), (1.62, IN_KIND), (1.63, DOES_NOT)]
)
def test_a_boundary_is_judged_by_its_distance(ours, verdict):
    assert RULES["boundary"].verdict(1.12, ours) is verdict


@pytest.mark.parametrize("rule", [*RULES.values(), OVERLAP])
def test_what_was_not_found_does_not_agree(rule):
    assert rule.verdict(1.0, math.nan) is DOES_NOT
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
    numbers = {key: number.value for key, number in printed.numbers.items()}
    for name in ("pan2021.toml", "pan2021_full.toml"):
        config = load_config(sweep_file(name))
        assert config.mesh.mean_stiffness_N_per_um_mm == numbers["mean_stiffness"]
        assert config.mesh.stiffness.cosine_N_per_um_mm == printed.harmonics.cosine
        assert config.mesh.stiffness.sine_N_per_um_mm == printed.harmonics.sine
        groups = config.groups.given()
        assert groups["mesh_frequency"] == pytest.approx(2.0 * np.pi * numbers["frequency"])
        assert groups["damping_ratio"] == pytest.approx(numbers["damping_ratio"] / np.sqrt(15.0))
        first, last, _ = config.sweep.span
        assert (first, last) == (printed.stages[0].first, printed.stages[-1].last)


def test_the_documentation_and_the_printed_numbers_say_the_same():
    text = (CLONE / "docs" / "model.md").read_text(encoding="utf-8").replace("−", "-")
    printed = published()
    values = [number.value for number in printed.numbers.values() if number.unit != "Hz"]
    values += [*printed.increments.values]
    values += [stage.first for stage in printed.stages] + [s.last for s in printed.stages]
    values += [motion.pitch_error for motion in printed.motions[:1]]
    missing = [value for value in values if f"{value:g}" not in text]
    assert not missing


def test_stages_follow_one_another_and_every_rule_is_known():
    printed = published()
    for before, after in zip(printed.stages, printed.stages[1:], strict=False):
        assert after.first == pytest.approx(before.last + 0.01)
    assert {number.rule for number in printed.numbers.values()} <= set(RULES)
    assert len(printed.increments.pitch_errors) == len(printed.increments.values) + 1


def test_every_printed_number_stands_in_the_file_once():
    text = CLONE / "gearchaos" / "paper" / "published.toml"
    keys = [row["key"] for row in tomllib.loads(text.read_text(encoding="utf-8"))["number"]]
    assert len(keys) == len(set(keys)) == len(published().numbers)


def test_table_2_holds_the_harmonics_of_the_contact_lines():
    series, trapezoid = printed_series(published()), contact_line_stiffness(published())
    ours, theirs = trapezoid.to_fourier(6).coefficients(), series.coefficients()
    assert np.max(np.abs(ours - theirs)) < 1e-3 * abs(theirs[0])


def test_the_fit_of_figure_4_leaves_the_trapezoid_by_its_missing_harmonics_alone():
    """Odd harmonics of a trapezoid in quarters have the amplitude 8 sqrt(2) h / (pi n)^2."""
    trapezoid, series = contact_line_stiffness(published()), printed_series(published())
    apart = np.max(np.abs(trapezoid.table(1000) - series.table(1000)))
    harmonics = np.abs(trapezoid.to_fourier(6).coefficients()[::2])
    size = 8.0 * np.sqrt(2.0) * trapezoid.half_height / np.pi**2
    assert harmonics == pytest.approx(size / np.array([1.0, 9.0, 25.0]))
    missing = size * np.sum(1.0 / np.arange(7.0, 20001.0, 2.0) ** 2)
    of_table_2 = np.sum(np.abs(trapezoid.to_fourier(6).coefficients() - series.coefficients()))
    assert size / 49.0 < apart < missing + of_table_2


def test_without_clearance_there_is_no_hop():
    """A linear system has one motion: sweeps upwards and downwards agree."""
    config = load_config(sweep_file("pan2021.toml"), [*COARSE, "groups.half_backlash=0.0"])
    assert find_hop(config, step=0.5) is None


@pytest.fixture(scope="module")
def found():
    """A gallery of few lanes and periods: all that depends on neither."""
    coarse = ["sweep.count=76", *COARSE]
    full = load_config(sweep_file("pan2021_full.toml"), ["sweep.count=1", *COARSE])
    return compute(load_config(sweep_file("pan2021.toml"), coarse), full, hop_step=0.1, periods=8)


@pytest.fixture(scope="module")
def folder(found, tmp_path_factory):
    folder = tmp_path_factory.mktemp("gallery")
    write_gallery(found, folder, formats=("png",))
    return folder


@pytest.mark.slow
def test_every_printed_number_is_compared(found):
    printed = published()
    assert our_numbers(printed, found).keys() == printed.numbers.keys()
    rows = Comparison(printed, found).rows
    harmonics = len(printed.harmonics.cosine) + len(printed.harmonics.sine)
    spans = len(printed.stages) + (len(printed.stages) - 1) + len(printed.motions)
    assert len(rows) == len(printed.numbers) + harmonics + spans + len(printed.increments.values)


@pytest.mark.slow
def test_derived_numbers_follow_from_table_1(found):
    ours, pair = our_numbers(published(), found), pair_of(found)
    assert ours["driven_speed"] == pytest.approx(2000.0 * 21 / 38)
    assert ours["mesh_frequency_hz"] == pytest.approx(700.0)
    assert ours["mesh_period"] == pytest.approx(1.0 / 0.1394)
    omega_h = np.sqrt(13.3548e9 * 0.015 / pair.equivalent_mass)
    assert ours["frequency"] == pytest.approx(2.0 * np.pi * 700.0 / omega_h)
    # xi = 0.1 with the stiffness of one millimetre is 0.1 / sqrt(15) with that of all 15.
    one_millimetre = 2.0 * 0.1 * np.sqrt(13.3548e6 * pair.equivalent_mass)
    assert ours["mesh_damping"] == pytest.approx(one_millimetre)


@pytest.mark.slow
def test_increments_of_separated_teeth_are_those_of_the_forcing(found):
    """While teeth are apart, delta_5'' = f_n + Omega^2 P e_r sin: 2 Omega^2 e_r for two e(tau)."""
    groups = found.response.parameters
    step = 2.0 * groups["mesh_frequency"].value ** 2 * groups["pitch_error_amplitude"].value
    values = [largest_acceleration(found.response, p) for p in (3.0, 5.0, 7.0, 9.0)]
    assert np.diff(values) == pytest.approx(step, rel=0.05)


@pytest.mark.slow
def test_both_motions_exist_between_the_folds_and_only_one_parts_the_teeth(found):
    hop = found.hop
    assert hop is not None
    change = hop.changes["rest"]
    assert hop.first < change.before < change.after < hop.last
    assert 0.0 < hop.share(published().numbers["hop"].value) < 1.0
    lanes = [lane_of(sweep, change.after) for sweep in (hop.upwards, hop.downwards)]
    crossings = [
        sweep["crossings_per_period"][lane]
        for sweep, lane in zip((hop.upwards, hop.downwards), lanes, strict=True)
    ]
    assert crossings[0] == 0.0 < crossings[1]


@pytest.mark.slow
def test_the_exponent_before_the_hop_is_that_of_the_sweep(found):
    """The teeth stay in contact: one linear system with periodic coefficients, whatever P."""
    values = found.sweep[found.sweep.axis]
    before = found.sweep["lyapunov_exponent"][values < found.hop.changes["rest"].before]
    assert before.size > 3
    assert before == pytest.approx(found.hop.changes["rest"].exponents[0], rel=1e-3)


@pytest.mark.slow
def test_stages_are_found_where_the_labels_are(found):
    first = counterparts(published().stages, found.sweep)[0]
    assert first is not None and first[0] == 0.0
    assert motion_at(found.sweep, first[1]) == "period 1"


@pytest.mark.slow
def test_the_report_shows_every_figure_and_every_row(found, folder):
    text = (folder / "report.md").read_text(encoding="utf-8")
    shown = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", text)
    assert shown == [f"{picture.name}.png" for picture in pictures()]
    assert all((folder / name).read_bytes().startswith(b"\x89PNG") for name in shown)
    for row in Comparison(published(), found).rows:
        assert f"| {row.quantity} | {row.where} | {row.published} | {row.ours} |" in text
    assert "$" not in text and " nan" not in text


@pytest.mark.slow
def test_results_lie_beside_the_report(found, folder):
    assert np.array_equal(open_result(folder / "sweep.h5")["motion"], found.sweep["motion"])
    assert "delta_4_acceleration" in open_result(folder / "accelerations.h5")


def test_the_gallery_in_the_documentation_is_whole():
    gallery = CLONE / "docs" / "gallery"
    text = (gallery / "report.md").read_text(encoding="utf-8")
    shown = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", text)
    assert shown == [f"{picture.name}.png" for picture in pictures()]
    assert all((gallery / name).is_file() for name in shown)


@pytest.mark.slow
def test_an_existing_gallery_is_kept(folder):
    with pytest.raises(FileError, match=r"holds report.md already.*--overwrite"):
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
