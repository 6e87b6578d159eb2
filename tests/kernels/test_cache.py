"""The cache of compiled code: a second process compiles nothing and runs only valid code."""

import atexit
import functools
import json
import logging
import os
import shutil
import site
import stat
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import NamedTemporaryFile

import gearchaos_kernels
import numpy as np
import pytest
from gearchaos_kernels.cache import cache_folder
from gearchaos_kernels.compilation import CACHE_FOLDER, source_hash

PACKAGE = Path(gearchaos_kernels.__file__).parent

# The program evaluates expressions. The Jacobian is the kernel that compiles fastest. `double`
# compiles even faster, separately for each type of argument, and is cached in the same way.
PROGRAM = """
import importlib, json, sys
import numba, numba.core.ccallback
for hook in sys.argv[2:]:
    where, _, name = hook.rpartition(".")
    module, _, kind = where.partition(":")
    holder = importlib.import_module(module)
    delattr(getattr(holder, kind) if kind else holder, name)
    if where + "." + name in sys.modules:
        sys.modules[where + "." + name] = None
limit, *expressions = json.loads(sys.argv[1])
if limit:
    import resource
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
import numpy as np
from gearchaos_kernels import Effects, Groups, GearPairs, evaluation
from gearchaos_kernels.compilation import CACHE_FOLDER, evaluator

@evaluator
def double(number):
    return 2 * number

# Numba refers to an array of more than 1 MB by its address.
TABLE = np.ones(200_000)

@evaluator
def first_of_table():
    return TABLE[0]

def jacobian(transverse):
    groups = Groups(*[np.full(1, 0.1) for _ in Groups._fields])
    effects = Effects(False, False, False, transverse, False)
    system = GearPairs(effects, groups, np.zeros(0), np.zeros(0))
    return evaluation.jacobian(system, np.ones((1, 2))).tolist()

values = [eval(expression) for expression in expressions]
stats = [function.stats for function in (evaluation._differentiate, double)]
print(json.dumps({
    "hits": sum(sum(counted.cache_hits.values()) for counted in stats),
    "misses": sum(sum(counted.cache_misses.values()) for counted in stats),
    "folder": str(CACHE_FOLDER),
    "values": values,
}))
"""
TORSIONAL, TRANSVERSE = "jacobian(False)", "jacobian(True)"
REAL, COMPLEX = "double(1.5)", "double(1.5j).imag"


def compute(
    cache: Path,
    *expressions: str,
    package: Path = PACKAGE,
    largest_file: int = 0,
    complaint: str | None = None,
    without: Sequence[str] = (),
    **variables: str,
) -> dict:
    """Evaluate expressions in a new process; return their values and its use of the cache.

    The process prints nothing to stderr, or one line that contains ``complaint``. ``without``:
    names to delete from Numba, such as ``numba.core.codegen.JITCodeLibrary``; names of a class have
    the form ``module:Class.name``.
    """
    arguments = [json.dumps([largest_file, *expressions]), *without]
    environment = {"NUMBA_CACHE_DIR": str(cache), **variables}
    with NamedTemporaryFile("r") as out, NamedTemporaryFile("r") as err:
        words = [PROGRAM, arguments, environment, str(package.parent), out.name, err.name]
        code, said = _code_of(words), err.read()
        assert code == 0, said
        if complaint is None:
            assert said == ""
        else:
            assert said.startswith("gearchaos: ")
            assert complaint in said
            assert said.count("\n") == 1
        return json.load(out)


def _code_of(words: list) -> int:
    """Let `numba_server` run a program, and return its exit code."""
    server = _server()
    server.stdin.write(json.dumps(words) + "\n")
    server.stdin.flush()
    return int(server.stdout.readline())


@functools.cache
def _server() -> subprocess.Popen[str]:
    script, pipe = Path(__file__).with_name("numba_server.py"), subprocess.PIPE
    server = subprocess.Popen([sys.executable, str(script)], stdin=pipe, stdout=pipe, text=True)
    atexit.register(server.communicate)
    return server


@pytest.fixture(scope="module")
def cache(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("caches") / "cache"


@pytest.fixture(scope="module")
def first(cache) -> dict:
    """Result of the first process, which has an empty cache."""
    return compute(cache, TORSIONAL)


@pytest.mark.slow
def test_a_second_process_compiles_only_scenes_that_none_has_seen(cache, first):
    assert (first["hits"], first["misses"]) == (0, 1)
    both = compute(cache, TORSIONAL, TRANSVERSE)
    assert (both["hits"], both["misses"]) == (1, 1)
    assert both["values"][:1] == first["values"]
    assert both["values"][1:] != first["values"]
    again = compute(cache, TRANSVERSE, TORSIONAL)
    assert (again["hits"], again["misses"]) == (2, 0)
    assert again["values"] == both["values"][::-1]


@pytest.mark.slow
def test_kept_code_runs_without_the_imports_of_a_compiler(tmp_path):
    # Not run in `numba_server`, which has already imported these modules.
    names = "numba.np.arrayobj", "numba.np.linalg", "scipy.linalg"
    imported = f"[name for name in {names} if name in sys.modules]"
    words = [sys.executable, "-c", PROGRAM, json.dumps([0, TORSIONAL, imported])]
    folders = {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(PACKAGE.parent)}
    for hits, misses in (0, 1), (1, 0):
        said = subprocess.run(words, env={**os.environ, **folders}, capture_output=True, check=True)
        outcome = json.loads(said.stdout)
        assert (outcome["hits"], outcome["misses"]) == (hits, misses)
        # The first process compiles and imports the modules that it needs for this.
        assert ("numba.np.linalg" in outcome["values"][1]) == (misses == 1)
    assert outcome["values"][1] == []


@pytest.mark.slow
def test_an_edited_formula_in_another_file_is_never_served_from_the_cache(cache, first, tmp_path):
    package = tmp_path / "gearchaos_kernels"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__"))
    equations = package / "models" / "gear_pair" / "equations.py"
    source = equations.read_text()
    line = "torsion = forcing.drive - force"
    assert source.count(line) == 1
    equations.write_text(source.replace(line, line.replace("- force", "- 2.0 * force")))
    edited = compute(cache, TORSIONAL, package=package)
    assert edited["misses"] == 1
    assert edited["values"] != first["values"]
    assert edited["folder"] != first["folder"]
    equations.write_text(source)
    restored = compute(cache, TORSIONAL, package=package)
    assert restored == first | {"hits": 1, "misses": 0}


@pytest.mark.slow
def test_damaged_code_is_never_run_but_named_in_one_line_and_replaced(tmp_path):
    folder = Path(compute(tmp_path, REAL, COMPLEX)["folder"])
    one, other = files = sorted(folder.iterdir())

    def computed(**options: str) -> tuple[int, int]:
        outcome = compute(tmp_path, REAL, COMPLEX, **options)
        assert outcome["values"] == [3.0, 3.0]
        assert sorted(folder.iterdir()) == files
        return outcome["hits"], outcome["misses"]

    os.truncate(one, one.stat().st_size // 2)
    content = bytearray(other.read_bytes())
    content[len(content) // 2] ^= 1
    other.write_bytes(content)
    assert computed(complaint=f"{folder}: damaged") == (0, 2)

    exchanged = one.read_bytes(), other.read_bytes()
    other.write_bytes(exchanged[0])
    one.write_bytes(exchanged[1])
    assert computed(complaint=f"{folder}: damaged") == (0, 2)
    assert computed() == (2, 0)


@pytest.mark.slow
def test_a_full_disk_does_not_stop_a_computation(tmp_path):
    folder = tmp_path / source_hash()
    complaint = f"{folder}: cannot keep compiled code"
    outcome = compute(tmp_path, REAL, COMPLEX, largest_file=999, complaint=complaint)
    assert outcome["values"] == [3.0, 3.0]
    assert list(folder.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "hook",
    [
        "numba.core.caching.NullCache",
        "numba.core.compiler:CompileResult._reduce",
        "numba.core.codegen:CPUCodegen.magic_tuple",
        "numba.core.runtime.rtsys",
    ],
)
def test_a_numba_whose_code_cannot_be_kept_computes_the_same(hook, tmp_path):
    folder = tmp_path / source_hash()
    complaint = "compiled code cannot be kept with Numba"
    outcome = compute(tmp_path, REAL, COMPLEX, without=[hook], complaint=complaint)
    assert outcome["values"] == [3.0, 3.0]
    assert list(folder.iterdir()) == []


@pytest.mark.slow
def test_code_with_addresses_of_its_process_is_not_kept(tmp_path):
    complaint = "it contains addresses of this process"
    assert compute(tmp_path, "first_of_table()", complaint=complaint)["values"] == [1.0]
    assert not list(tmp_path.rglob("*.nbc"))


@pytest.mark.slow
def test_code_that_another_numba_cannot_load_is_compiled(tmp_path):
    assert compute(tmp_path, REAL)["misses"] == 1
    hook, complaint = "numba.core.compiler:CompileResult._rebuild", "AttributeError: "
    assert compute(tmp_path, REAL, without=[hook], complaint=complaint)["values"] == [3.0]


@pytest.mark.slow
def test_a_numba_without_what_speeds_up_compilation_computes_the_same(first, tmp_path):
    without = ["numba.core.codegen.JITCodeLibrary", "numba.core.cpu.CPUTargetOptions"]
    without += ["numba.core.event", "numba.misc.appdirs.user_cache_dir"]
    outcome = compute(tmp_path, TORSIONAL, without=without)
    # The compiled code may differ and round differently.
    np.testing.assert_allclose(outcome["values"], first["values"], rtol=1e-14)
    assert compute(tmp_path, TORSIONAL, without=without)["hits"] == 1


@pytest.mark.parametrize(
    "name", sorted(str(path.relative_to(PACKAGE)) for path in PACKAGE.rglob("*.py"))
)
def test_the_name_of_the_cache_folder_depends_on_every_kernel_source(name, tmp_path):
    package = tmp_path / "gearchaos_kernels"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__"))

    def source_hash() -> str:
        namespace = {"__file__": str(package / "compilation.py"), "__name__": "copied"}
        text = (package / "compilation.py").read_text().split("CACHE_FOLDER = ")[0]
        exec(compile(text, "compilation.py", "exec"), namespace)
        return namespace["source_hash"]()

    before = source_hash()
    with (package / name).open("a") as file:
        file.write("# edited\n")
    assert source_hash() != before


def test_compiled_code_lies_outside_the_installed_packages(cache, first):
    assert Path(first["folder"]).parent == cache
    installed = [Path(folder) for folder in (*site.getsitepackages(), PACKAGE.parent)]
    assert not any(CACHE_FOLDER.is_relative_to(folder) for folder in installed)
    assert list(PACKAGE.rglob("*.nb?")) == []


@pytest.mark.skipif(sys.platform != "linux", reason="tests the cache folder of Linux")
def test_without_a_setting_the_cache_lies_in_the_users_cache_folder(tmp_path, monkeypatch):
    monkeypatch.setattr("numba.config.CACHE_DIR", "")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert cache_folder("name") == tmp_path / "xdg" / "gearchaos" / "name"
    for unset in ("", "relative"):
        monkeypatch.setenv("XDG_CACHE_HOME", unset)
        assert cache_folder("name") == tmp_path / "home" / ".cache" / "gearchaos" / "name"
    assert {path.name for path in tmp_path.iterdir()} == {"home", "xdg"}


def test_folders_that_are_made_are_private(tmp_path, monkeypatch):
    monkeypatch.setattr("numba.config.CACHE_DIR", str(tmp_path / "parent" / "cache"))
    folder = cache_folder("name")
    assert folder == tmp_path / "parent" / "cache" / "name"
    for made in (folder, folder.parent, folder.parent.parent):
        assert stat.S_IMODE(made.stat().st_mode) == 0o700


def _refused(tmp_path, monkeypatch, caplog) -> str:
    """Return the reason why a folder is not used; a private temporary folder replaces it."""
    monkeypatch.setattr("numba.config.CACHE_DIR", str(tmp_path / "parent" / "cache"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    # Packages that other tests use may have configured the logging of this process.
    monkeypatch.setattr(logging.getLogger("gearchaos"), "disabled", False)
    monkeypatch.setattr(logging.getLogger("gearchaos"), "propagate", True)
    caplog.set_level(logging.WARNING, "gearchaos")
    folder = cache_folder("name")
    assert folder.parent == tmp_path
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    (record,) = caplog.records
    text = record.getMessage()
    assert text.startswith(f"gearchaos: {tmp_path / 'parent' / 'cache' / 'name'} is not used")
    assert "set NUMBA_CACHE_DIR" in text
    assert "\n" not in text
    return text


def test_a_cache_folder_that_cannot_be_made_is_not_used(tmp_path, monkeypatch, caplog):
    (tmp_path / "parent").write_text("not a folder")
    assert f"File exists: '{tmp_path / 'parent'}'" in _refused(tmp_path, monkeypatch, caplog)


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="needs POSIX file modes and owners")
@pytest.mark.parametrize(
    ("name", "mode"),
    [
        ("parent/cache/name", 0o770),
        ("parent/cache/name", 0o1777),
        ("parent/cache", 0o777),
        ("parent", 0o775),
        ("parent", 0o702),
    ],
)
def test_a_cache_folder_that_others_can_write_or_replace_is_not_used(
    name, mode, tmp_path, monkeypatch, caplog
):
    (tmp_path / "parent" / "cache" / "name").mkdir(parents=True)
    (tmp_path / name).chmod(mode)
    assert f"others can write in {tmp_path / name}" in _refused(tmp_path, monkeypatch, caplog)


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="needs POSIX file modes and owners")
def test_a_sticky_parent_such_as_tmp_is_fine(tmp_path, monkeypatch, caplog):
    (tmp_path / "parent").mkdir()
    (tmp_path / "parent").chmod(0o1777)
    monkeypatch.setattr("numba.config.CACHE_DIR", str(tmp_path / "parent"))
    assert cache_folder("name") == tmp_path / "parent" / "name"
    assert caplog.records == []


@pytest.mark.skipif(
    os.name != "posix" or os.geteuid() != 0, reason="only root can change the owner of a file"
)
@pytest.mark.parametrize("name", ["parent/cache/name", "parent"])
def test_a_cache_folder_of_another_user_is_not_used(name, tmp_path, monkeypatch, caplog):
    (tmp_path / "parent" / "cache" / "name").mkdir(parents=True)
    os.chown(tmp_path / name, 65534, 65534)
    assert f"{tmp_path / name} belongs to another user" in _refused(tmp_path, monkeypatch, caplog)


@pytest.mark.slow
def test_an_unwritable_home_does_not_stop_a_computation(tmp_path):
    blocked = tmp_path / "home"
    blocked.write_text("not a folder")
    home = {"NUMBA_CACHE_DIR": "", "HOME": str(blocked), "XDG_CACHE_HOME": ""}
    outcome = compute(tmp_path, REAL, complaint=str(blocked), **home)
    assert outcome["values"] == [3.0]
    # The temporary folder is removed at the end.
    assert not Path(outcome["folder"]).exists()
