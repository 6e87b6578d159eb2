"""The cache of compiled code: a second process compiles nothing, and never runs stale code."""

import json
import os
import shutil
import site
import stat
import subprocess
import sys
from pathlib import Path

import gearchaos_kernels
import pytest

PACKAGE = Path(gearchaos_kernels.__file__).parent

PROGRAM = """
import json, sys
import numpy as np
from gearchaos_kernels import Effects, Groups, Plan, System, integrate
from gearchaos_kernels.batch import _integrate_blocks
from gearchaos_kernels.compilation import CACHE_FOLDER

groups = Groups(*[np.full(1, 0.1) for _ in Groups._fields])
ends = []
for backlash in json.loads(sys.argv[1]):
    effects = Effects(False, False, backlash, False, False)
    nothing = np.zeros(0)
    system = System(effects, groups, nothing, nothing)
    ends.append(integrate(system, np.ones((1, 2)), Plan(50, 0, 1, 0)).end_state[0, 0])
stats = _integrate_blocks.stats
print(json.dumps({
    "hits": sum(stats.cache_hits.values()),
    "misses": sum(stats.cache_misses.values()),
    "folder": str(CACHE_FOLDER),
    "ends": ends,
}))
"""
LINEAR, CLEARANCE = False, True


def integrate(cache: Path, *scenes: bool, package: Path = PACKAGE, home: Path | None = None):
    """Integrate scenes in a new process and return what it says of its cache."""
    environment = {**os.environ, "PYTHONPATH": str(package.parent), "PYTHONDONTWRITEBYTECODE": "1"}
    environment.pop("NUMBA_CACHE_DIR", None)
    if home is None:
        environment["NUMBA_CACHE_DIR"] = str(cache)
    else:
        environment.update(HOME=str(home), XDG_CACHE_HOME=str(home / ".cache"))
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", PROGRAM, json.dumps(scenes)],
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def cache(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="module")
def first(cache) -> dict:
    """What the first process, with an empty cache, says."""
    return integrate(cache, LINEAR)


@pytest.mark.slow
def test_a_second_process_compiles_only_scenes_that_none_has_seen(cache, first):
    assert (first["hits"], first["misses"]) == (0, 1)
    second = integrate(cache, LINEAR)
    assert (second["hits"], second["misses"]) == (1, 0)
    assert second["ends"] == first["ends"]
    third = integrate(cache, CLEARANCE)
    assert (third["hits"], third["misses"]) == (0, 1)
    assert third["ends"] != first["ends"]
    fourth = integrate(cache, CLEARANCE, LINEAR)
    assert (fourth["hits"], fourth["misses"]) == (2, 0)
    assert fourth["ends"] == third["ends"] + first["ends"]


@pytest.mark.slow
def test_an_edited_formula_in_another_file_is_never_served_from_the_cache(cache, first, tmp_path):
    package = tmp_path / "gearchaos_kernels"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__"))
    copy = integrate(cache, LINEAR, package=package)
    assert copy["ends"] == first["ends"]
    equations = package / "equations.py"
    source = equations.read_text()
    line = "return stiffness * gap.value + damping * gap.rate, stiffness"
    assert source.count(line) == 1
    changed = source.replace(line, line.replace("stiffness * gap", "stiffness * 2.0 * gap"))
    equations.write_text(changed)
    edited = integrate(cache, LINEAR, package=package)
    assert edited["misses"] == 1
    assert edited["ends"] != first["ends"]
    assert edited["folder"] != copy["folder"]
    equations.write_text(source)
    restored = integrate(cache, LINEAR, package=package)
    assert restored["ends"] == first["ends"]
    assert restored["folder"] == copy["folder"]


@pytest.mark.parametrize("name", sorted(path.name for path in PACKAGE.glob("*.py")))
def test_the_name_of_the_cache_folder_depends_on_every_kernel_source(name, tmp_path):
    package = tmp_path / "gearchaos_kernels"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__"))

    def source_hash() -> str:
        # compilation.py imports nothing of its package: it can be run as a file of its own.
        namespace = {"__file__": str(package / "compilation.py"), "__name__": "copied"}
        text = (package / "compilation.py").read_text().split("CACHE_FOLDER = cache_folder()")[0]
        exec(compile(text, "compilation.py", "exec"), namespace)
        return namespace["source_hash"]()

    before = source_hash()
    with (package / name).open("a") as file:
        file.write("# edited\n")
    assert source_hash() != before


def test_compiled_code_lies_outside_the_installed_packages(cache, first):
    assert Path(first["folder"]).parent == cache
    from gearchaos_kernels.compilation import CACHE_FOLDER

    installed = [Path(folder) for folder in (*site.getsitepackages(), PACKAGE.parent)]
    assert not any(CACHE_FOLDER.is_relative_to(folder) for folder in installed)
    assert list(PACKAGE.rglob("*.nbi")) == []


def test_without_a_setting_the_cache_lies_in_the_users_cache_folder(tmp_path, monkeypatch):
    from gearchaos_kernels import compilation

    monkeypatch.setattr(compilation.config, "CACHE_DIR", "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    if sys.platform == "linux":
        assert compilation.cache_folder() == tmp_path / "gearchaos" / compilation.source_hash()


def test_a_cache_folder_that_cannot_be_made_gives_way_to_a_private_temporary_one(
    tmp_path, monkeypatch
):
    from gearchaos_kernels import compilation

    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    monkeypatch.setattr(compilation.config, "CACHE_DIR", str(blocked))
    monkeypatch.setattr(compilation.tempfile, "tempdir", str(tmp_path))
    folder = compilation.cache_folder()
    assert folder.parent == tmp_path
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700


@pytest.mark.slow
def test_an_unwritable_home_does_not_stop_a_computation(tmp_path, first):
    blocked = tmp_path / "home"
    blocked.write_text("not a folder")
    outcome = integrate(tmp_path, LINEAR, home=blocked)
    assert outcome["ends"] == first["ends"]
    # What cannot be kept does not litter.
    assert not Path(outcome["folder"]).exists()
