"""Docstrings of public names have the sections of numpydoc, and their examples run."""

import ast
import doctest
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gearchaos_kernels
import numpy as np
import pytest
from matplotlib.figure import Figure

import gearchaos
from gearchaos import figures, iso1328
from gearchaos.engine.basins import find_basins
from gearchaos.results.reading.ensembles import motion_shares
from gearchaos.results.reading.jumps import crises, jumps
from gearchaos.results.reading.overview import overview
from gearchaos.results.reading.stage_table import labelled_lanes, stage_table

CLONE = Path(__file__).resolve().parents[2]
PAGE = (CLONE / "docs" / "api.md").read_text()
READING = (find_basins, motion_shares, crises, jumps, overview, labelled_lanes, stage_table)
SHORT = ("integration.transient_periods=50", "integration.recorded_periods=20")
SHORT += ("outputs.section_points=10",)
ONE_VALUE = ("sweep={parameter='pitch_error', values=[5.0]}",)

# Sweeps that the examples read, with just enough lanes and periods for every figure.
FILES = {
    "pan2021": ("sweep={parameter='pitch_error', from=2.5, to=12.5, count=5}",),
    "speeds": (
        "sweep={parameter='mesh_frequency', values=[0.8, 0.9]}",
        "outputs.orders=['1/2', 1]",
        "mesh.length_scale_um=10.0",
    ),
    "chart": (
        "sweep={parameter='pitch_error', values=[2.0, 5.0, 8.0]}",
        "second_sweep={parameter='mesh_frequency', values=[0.85, 0.9]}",
    ),
    "starts": (
        "sweep={parameter='pitch_error', values=[1.0, 5.0]}",
        "start={kind='random', count=3}",
    ),
    "grid": (
        "sweep={parameter='pitch_error', values=[1.04]}",
        "start={kind='grid', count=2, box={delta_5=[0, 2], delta_5_rate=[-1, 1]}}",
    ),
}


def public() -> Iterator[tuple[str, Any]]:
    """Yield every public function, class and method with its dotted name."""
    homes = {
        "gearchaos": [getattr(gearchaos, name) for name in gearchaos.__all__],
        "iso1328": [*vars(iso1328).values()],
        "figures": [*vars(figures).values()],
        "gearchaos_kernels": [*vars(gearchaos_kernels).values()],
        "reading": READING,
    }
    for home, members in homes.items():
        for one in members:
            own = getattr(one, "__module__", "") or ""
            callable_here = (inspect.isfunction(one) or inspect.isclass(one)) and (
                home != "iso1328" or own == "gearchaos.iso1328"
            )
            if callable_here and not one.__name__.startswith("_"):
                yield f"{home}.{one.__name__}", one
            # Models define the methods of lane systems; only their base class is public.
            if inspect.isclass(one) and own.startswith("gearchaos."):
                for name, method in [*vars(one).items()]:
                    function = getattr(method, "__func__", method)
                    # model_post_init is a method of pydantic.
                    own_name = not name.startswith("_") and name != "model_post_init"
                    if inspect.isfunction(function) and own_name:
                        yield f"{home}.{one.__name__}.{name}", function


PUBLIC = dict(public())


def sections(text: str) -> dict[str, str]:
    """Split a docstring into its numpydoc sections."""
    parts = re.split(r"^(\w+)\n-{3,}\n", text, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def missing(name: str, one: Any) -> list[str]:
    """Return the parts that the docstring of a public name lacks."""
    found = sections(inspect.getdoc(one) or "")
    if inspect.isclass(one):
        described = {"Attributes", "Parameters"} & {*found}
        return [] if described or issubclass(one, Exception) else ["Attributes"]
    signature = inspect.signature(one)
    # The first parameter of a method is its instance.
    named = [*signature.parameters][1 if name.count(".") == 2 else 0 :]
    heads = re.findall(r"^\S.*$", found.get("Parameters", ""), re.MULTILINE)
    listed = {part.strip("* ") for head in heads for part in head.partition(" :")[0].split(",")}
    lacking = [f"parameter {parameter}" for parameter in named if parameter not in listed]
    returns = signature.return_annotation not in (None, "None", inspect.Signature.empty)
    if returns and not {"Returns", "Yields"} & {*found}:
        lacking.append("Returns")
    short = name.rpartition(".")[2]
    if "Examples" not in found and not re.search(rf"[`.]{short}[(`]", PAGE):
        lacking.append("Examples")
    return lacking


def test_all_public_names_are_checked():
    assert len(PUBLIC) >= 80
    assert {"gearchaos.run", "gearchaos.System.orbit", "figures.lyapunov"} < {*PUBLIC}


@pytest.mark.parametrize("name", PUBLIC)
def test_a_public_name_has_the_sections_of_numpydoc(name):
    assert missing(name, PUBLIC[name]) == []


def test_a_docstring_without_sections_is_found():
    def bare(given: int) -> int:
        """Return it."""
        return given

    assert missing("gearchaos.bare", bare) == ["parameter given", "Returns", "Examples"]


@pytest.fixture(scope="module")
def names(tmp_path_factory):
    """Prepare a folder with the results that the examples read; yield the names they use."""
    folder = tmp_path_factory.mktemp("examples")
    (folder / "sweeps").symlink_to(CLONE / "sweeps")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for name, overrides in FILES.items():
            config = gearchaos.load_config("sweeps/pan2021.toml", [*SHORT, *overrides])
            gearchaos.run(config).save(f"{name}.h5")
        response = gearchaos.load_config("sweeps/pan2021.toml", [*SHORT, *ONE_VALUE])
        gearchaos.respond(response, periods=8).save("response.h5")
        system = gearchaos.System("sweeps/pan2021.toml", pitch_error=10.75)
        yield {
            "controller": gearchaos.Controller(system, system.orbit(period=2)),
            "gearchaos": gearchaos,
            "figures": figures,
            "np": np,
            "Figure": Figure,
            **{name: getattr(gearchaos_kernels, name) for name in dir(gearchaos_kernels)},
            "config": gearchaos.load_config("sweeps/pan2021.toml"),
            "result": gearchaos.open_result("pan2021.h5"),
            "system": gearchaos.System("sweeps/pan2021.toml", pitch_error=10.75),
        }


def test_the_examples_run(names):
    finder = doctest.DocTestFinder(recurse=False)
    runner = doctest.DocTestRunner(optionflags=doctest.REPORT_NDIFF)
    reports: list[str] = []
    for name, one in PUBLIC.items():
        for test in finder.find(one, name, globs=dict(names)):
            runner.run(test, out=reports.append)
    assert runner.summarize(verbose=False).failed == 0, "".join(reports)
    assert runner.tries > 60


def test_functions_are_short_and_have_few_arguments():
    """Docstrings may be long; the code of a function may not."""
    found = 0
    for path in (CLONE / "gearchaos").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.FunctionDef):
                continue
            found += 1
            documented = ast.get_docstring(node) is not None
            first = node.body[0].end_lineno if documented else node.lineno
            assert node.end_lineno - first <= 50, f"{path.name}: {node.name}"
            arguments = [one.arg for one in ast.walk(node.args) if isinstance(one, ast.arg)]
            if "It has nine arguments, because" not in (ast.get_docstring(node) or ""):
                assert len([one for one in arguments if one not in ("self", "cls")]) <= 8, node.name
    assert found > 1500
