"""Compiled code on disk: stored where only the user can write, loaded only if unchanged.

Loaded code is executed, so it must be trusted. Numba's own cache trusts every file that it finds,
and its index can name files that another process has just written for another signature. Here each
signature has its own file, which begins with a checksum of its name and content.
"""

import atexit
import functools
import hashlib
import io
import logging
import os
import pickle
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba import config

# Private parts of Numba. In a version without them, every process compiles anew.
try:
    from numba.core.caching import NullCache
    from numba.core.compiler import CompileResult
    from numba.core.environment import Environment, lookup_environment
    from numba.core.runtime import rtsys
    from numba.core.serialize import dumps
except ImportError:
    NullCache = object
    CompileResult = Environment = dumps = lookup_environment = rtsys = None
try:
    from numba.misc.appdirs import user_cache_dir
except ImportError:

    def user_cache_dir(name: str) -> str:
        """Return the user's cache folder on Linux; a relative path if none is set."""
        return os.path.join(os.environ.get("XDG_CACHE_HOME", ""), name)


def cache_folder(name: str) -> Path:
    """Return a folder of this name for compiled code that only the user can write.

    The parent folder is ``NUMBA_CACHE_DIR`` if it is set, otherwise the user's cache folder. If the
    folder is not writable, or others can write or replace it, a message says so and a temporary
    folder is used for this process.
    """
    folder = Path(config.CACHE_DIR or user_cache_dir("gearchaos"), name)
    try:
        if not (config.CACHE_DIR or folder.is_absolute()):
            # XDG_CACHE_HOME counts as unset if it is empty or relative.
            folder = Path("~/.cache/gearchaos", name).expanduser()
        folder = folder.resolve()
        for path in (*reversed(folder.parents), folder):
            path.mkdir(mode=0o700, exist_ok=True)
            _require_ours(path, sticky=path != folder)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except (OSError, RuntimeError) as error:  # RuntimeError: there is no home folder.
        _warn(
            f"{folder} is not used for compiled code, every process compiles anew ({error}); "
            "set NUMBA_CACHE_DIR to a folder that only you can write"
        )
        private = Path(tempfile.mkdtemp(prefix="gearchaos-"))
        atexit.register(shutil.rmtree, private, ignore_errors=True)
        return private


def _require_ours(path: Path, sticky: bool) -> None:
    """Raise OSError if others may write a folder; a sticky one protects what it contains."""
    if not hasattr(os, "geteuid"):  # Windows.
        return
    about = path.stat()
    if about.st_uid not in (0, os.geteuid()):
        raise PermissionError(f"{path} belongs to another user")
    if about.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        if not (sticky and about.st_mode & stat.S_ISVTX):
            raise PermissionError(f"others can write in {path}")


@functools.cache
def _warn(text: str) -> None:
    """Log a warning once; without a logging configuration it appears on stderr."""
    logging.getLogger("gearchaos").warning("gearchaos: %s", text)


def keep_compiled(dispatcher: Any, folder: Path) -> None:
    """Cache the compiled code of a dispatcher in a folder, if this version of Numba permits it."""
    if CompileResult is None or not hasattr(dispatcher, "_cache"):
        _warn_unfit("it has another cache")
    else:
        dispatcher._cache = KernelCache(dispatcher.py_func, folder)
        # Kernels need no extensions of Numba, and to look for them reads the facts of all packages.
        dispatcher._compilation_chain_init_hook = lambda: None


def _warn_unfit(fault: object) -> None:
    """Warn that this version of Numba cannot use the cache."""
    _warn(
        f"compiled code cannot be kept with Numba {numba.__version__} ({fault}), every process "
        "compiles anew; install an older version of Numba"
    )


class KernelCache(NullCache):  # type: ignore[misc]
    """The compiled code of one function in a folder, with one file per signature."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        """Remember function and folder; nothing is read or written yet."""
        self._function, self._folder = function, folder

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the cached code of a signature, or None if it has to be compiled."""
        try:
            return self._load(sig, target_context)
        except Exception as error:  # Other versions of Numba may raise anything.
            _warn_unfit(f"{type(error).__name__}: {error}")
            return None

    def _load(self, sig: Any, target_context: Any) -> Any:
        """Return the cached code of a signature, or None; the errors are those of Numba."""
        # Loaded code needs only this part of `refresh`, which imports all that compilation needs.
        rtsys.initialize(target_context)
        path = self._path(sig, target_context.codegen())
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError:
            content = b""
        data = content[hashlib.sha256().digest_size :]
        if content != _sealed(path, data):
            _warn(f"{self._folder}: damaged compiled code is not used, but compiled and kept anew")
            return None
        return CompileResult._rebuild(target_context, *_Unpickler(io.BytesIO(data)).load())

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store code for later processes; if that fails, a warning names the remedy."""
        try:
            if data.library.has_dynamic_globals:
                _warn_unfit("it contains addresses of this process")
                return
            path = self._path(sig, data.codegen)
            with tempfile.TemporaryDirectory(dir=self._folder) as folder:
                written = Path(folder, path.name)
                written.touch(0o600)
                written.write_bytes(_sealed(path, dumps(data._reduce())))
                written.replace(path)
        except OSError as error:
            _warn(
                f"{self._folder}: cannot keep compiled code, every process compiles anew "
                f"({error.strerror}); free space there or set NUMBA_CACHE_DIR to another folder"
            )
        except Exception as error:  # Other versions of Numba may raise anything.
            _warn_unfit(f"{type(error).__name__}: {error}")

    def _path(self, sig: Any, codegen: Any) -> Path:
        """Return the file of a signature, named after everything that determines its content.

        The kernel sources are not part of the name: they determine the folder.
        """
        name = f"{self._function.__module__}.{self._function.__qualname__}"
        key = f"{name} {sig} {codegen.magic_tuple()} {sys.version}"
        return self._folder / f"{name}-{hashlib.sha256(key.encode()).hexdigest()[:32]}.nbc"


class _Unpickler(pickle.Unpickler):
    """Reads cached code without the modules of Numba whose functions it contains.

    Numba imports them for the environments of these functions, which takes longer than all else.
    """

    def find_class(self, module: str, name: str) -> Any:
        """Return what pickled data names, with another way to make environments."""
        ours = name == "_rebuild_env" and module == Environment.__module__
        return _environment if ours else super().find_class(module, name)


def _environment(module: str, constants: list[Any], name: str) -> Any:
    """Return the environment of a compiled function of a module, which need not be imported.

    Compiled code reads the constants. Only interpreted code would look up names of the module.
    """
    found = lookup_environment(name)
    if found is None:
        found = Environment({"__name__": module})
        found.consts[:] = constants
        found.env_name = name
        Environment._memo[name] = found
    return found


def _sealed(path: Path, data: bytes) -> bytes:
    """Return data after a checksum of the name of its file and of itself."""
    return hashlib.sha256(path.name.encode() + data).digest() + data
