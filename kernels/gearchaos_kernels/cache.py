"""Compiled code on disk: kept where nobody else can write, loaded only as it was written.

What is loaded is executed. Numba's own cache believes every file that it finds, and its index can
end up with the names of files that another process has just written for another signature. Here
each signature has a file of its own, which begins with a checksum of its name and of the rest.
"""

import atexit
import functools
import hashlib
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

# What Numba keeps to itself: where a version lacks it, every process compiles anew.
try:
    from numba.core.caching import NullCache
    from numba.core.compiler import CompileResult
    from numba.core.serialize import dumps
except ImportError:
    NullCache = object
    CompileResult = dumps = None
try:
    from numba.misc.appdirs import user_cache_dir
except ImportError:

    def user_cache_dir(name: str) -> str:
        """Return the user's cache folder of Linux, a relative one where none is set."""
        return os.path.join(os.environ.get("XDG_CACHE_HOME", ""), name)


def cache_folder(name: str) -> Path:
    """Return a writable folder of this name for compiled code that nobody else can write.

    Numba's own setting (``NUMBA_CACHE_DIR``) is the parent folder where it is set, otherwise the
    user's cache folder. Where that cannot be written, or others can write it or put another folder
    in its place, a line says so and a private temporary folder serves one process.
    """
    folder = Path(config.CACHE_DIR or user_cache_dir("gearchaos"), name)
    try:
        if not (config.CACHE_DIR or folder.is_absolute()):
            # XDG_CACHE_HOME counts as unset where it is empty or relative.
            folder = Path("~/.cache/gearchaos", name).expanduser()
        folder = folder.resolve()
        for path in (*reversed(folder.parents), folder):
            path.mkdir(mode=0o700, exist_ok=True)
            _require_ours(path, sticky=path != folder)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except (OSError, RuntimeError) as error:  # RuntimeError: there is no home folder.
        _tell(
            f"{folder} is not used for compiled code, every process compiles anew ({error}); "
            "set NUMBA_CACHE_DIR to a folder that only you can write"
        )
        private = Path(tempfile.mkdtemp(prefix="gearchaos-"))
        atexit.register(shutil.rmtree, private, ignore_errors=True)
        return private


def _require_ours(path: Path, sticky: bool) -> None:
    """Raise OSError where others may write; in a sticky folder nobody moves what is ours."""
    if not hasattr(os, "geteuid"):  # Windows.
        return
    about = path.stat()
    if about.st_uid not in (0, os.geteuid()):
        raise PermissionError(f"{path} belongs to another user")
    if about.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        if not (sticky and about.st_mode & stat.S_ISVTX):
            raise PermissionError(f"others can write in {path}")


@functools.cache
def _tell(text: str) -> None:
    """Say it once: as a line on stderr, unless the process has set up logging."""
    logging.getLogger("gearchaos").warning("gearchaos: %s", text)


def keep_compiled(dispatcher: Any, folder: Path) -> None:
    """Keep the compiled code of a dispatcher in a folder, if this version of Numba lets it."""
    if CompileResult is None or not hasattr(dispatcher, "_cache"):
        _tell_unfit("it has another cache")
    else:
        dispatcher._cache = KernelCache(dispatcher.py_func, folder)


def _tell_unfit(fault: object) -> None:
    _tell(
        f"compiled code cannot be kept with Numba {numba.__version__} ({fault}), every process "
        "compiles anew; install an older version of Numba"
    )


class KernelCache(NullCache):  # type: ignore[misc]
    """The compiled code of one function in a folder, one file for each signature."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        """Read and write nothing yet."""
        self._function, self._folder = function, folder

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the code that was kept for a signature, or None where it has to be compiled."""
        try:
            return self._load(sig, target_context)
        except Exception as error:  # Whatever another version of Numba raises.
            _tell_unfit(f"{type(error).__name__}: {error}")
            return None

    def _load(self, sig: Any, target_context: Any) -> Any:
        target_context.refresh()
        path = self._path(sig, target_context.codegen())
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError:
            content = b""
        data = content[hashlib.sha256().digest_size :]
        if content != _sealed(path, data):
            _tell(f"{self._folder}: damaged compiled code is not used, but compiled and kept anew")
            return None
        return CompileResult._rebuild(target_context, *pickle.loads(data))

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep code for later processes; where that fails, a line says what to do about it."""
        try:
            if data.library.has_dynamic_globals:  # Addresses in this process.
                return
            path = self._path(sig, data.codegen)
            with tempfile.TemporaryDirectory(dir=self._folder) as folder:
                written = Path(folder, path.name)
                written.touch(0o600)
                written.write_bytes(_sealed(path, dumps(data._reduce())))
                written.replace(path)
        except OSError as error:
            _tell(
                f"{self._folder}: cannot keep compiled code, every process compiles anew "
                f"({error.strerror}); free space there or set NUMBA_CACHE_DIR to another folder"
            )
        except Exception as error:  # Whatever another version of Numba raises.
            _tell_unfit(f"{type(error).__name__}: {error}")

    def _path(self, sig: Any, codegen: Any) -> Path:
        """Name a file after all that decides what is in it; the folder stands for the sources."""
        name = f"{self._function.__module__}.{self._function.__qualname__}"
        key = f"{name} {sig} {codegen.magic_tuple()} {sys.version}"
        return self._folder / f"{name}-{hashlib.sha256(key.encode()).hexdigest()[:32]}.nbc"


def _sealed(path: Path, data: bytes) -> bytes:
    return hashlib.sha256(path.name.encode() + data).digest() + data
