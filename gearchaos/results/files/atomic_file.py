"""Files that appear complete or not at all, with a checksum at their end.

The last line of a result file is a checksum of all bytes before it. HDF5 has checksums of the
numbers of a dataset, but not of texts and of its own structures; damage in the latter can make its
library loop forever. Readers of HDF5 ignore a line after the end of the data. gearchaos checks this
line before it opens the file with the library.
"""

import errno
import hashlib
import os
import re
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from shutil import copymode

from gearchaos.errors import FileError

PARTIAL = ".partial"
"""Ending of the names of unfinished files. Nothing reads them; they can be deleted."""

UNDISTURBED: int = sum(getattr(os, f"O_{flag}", 0) for flag in ("NOFOLLOW", "NONBLOCK", "BINARY"))
"""Flags for files in a folder of our own: do not follow a link, do not wait for a writer.

Without the last flag, Windows converts line endings.
"""

_TO_SYNCHRONISE = os.O_RDWR if os.name == "nt" else os.O_RDONLY
"""Windows synchronises only files that are open for writing."""

_REMEDIES = {
    errno.ENOSPC: "free some space or choose another place",
    errno.EDQUOT: "free some space or choose another place",
    errno.EFBIG: "raise the limit on the size of files or choose another place",
    errno.ENOENT: "create the folder first",
    errno.ENOTDIR: "choose a place inside a folder",
    errno.EISDIR: "give the name of a file",
    errno.ENAMETOOLONG: "choose a shorter name",
}

_PREFIX = b"gearchaos sha256 "
_LENGTH = len(_PREFIX) + 2 * hashlib.sha256().digest_size + 1
_PIECE = 1 << 20


def reason(error: BaseException) -> str:
    """Return the cause of a failed operation in words, also if only a text of HDF5 contains it."""
    number = getattr(error, "errno", None)
    if number is None and (found := re.search(r"errno = (\d+)", str(error))):
        number = int(found[1])
    if number:
        return os.strerror(number)
    return " ".join(str(error).split()) or type(error).__name__


@contextmanager
def writing(path: str | os.PathLike[str]) -> Iterator[None]:
    """Turn an error while a file is written into a FileError with a remedy."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        # h5py raises a RuntimeError if the disk is full when a file is closed.
        if isinstance(error, RuntimeError) and "errno = " not in str(error):
            raise
        text = reason(error)
        by_text = {os.strerror(code): remedy for code, remedy in _REMEDIES.items()}
        remedy = by_text.get(text, "choose another place")
        raise FileError(f"{path}: cannot be written: {text}; {remedy}") from error


def check_output(path: str | os.PathLike[str], overwrite: bool = False) -> None:
    """Check that a file can be written, before anything is computed for it.

    Parameters
    ----------
    path : path-like
        Name of the file.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    FileError
        If the file exists and must not be replaced, if it is a directory or a device, or if its
        folder is missing or cannot be written to.
    """
    with writing(path):
        target = _checked_target(path, overwrite)
        _create_partial(target.parent, target.name).unlink()


def unlinked_content(path: Path, most: int) -> bytes:
    """Read at most this number of bytes of a file; fail on a link, and do not wait for data."""
    descriptor = os.open(path, os.O_RDONLY | UNDISTURBED)
    with open(descriptor, "rb") as file:
        return file.read(min(most, os.fstat(descriptor).st_size))


@contextmanager
def replacing(
    path: str | os.PathLike[str],
    *,
    overwrite: bool = False,
    scratch: str | os.PathLike[str] | None = None,
    through_links: bool = True,
) -> Iterator[Path]:
    """Write a file under a temporary name, and rename it once it is complete on the disk.

    The new file has the permissions of the one it replaces.

    Parameters
    ----------
    path : path-like
        Name of the file.
    overwrite : bool
        Whether an existing file is replaced.
    scratch : path-like, optional
        Folder of the temporary file, on the same file system. By default the folder of the file.
    through_links : bool
        Whether the target of a symbolic link is written. Otherwise the link itself is replaced.

    Yields
    ------
    Path
        An empty temporary file, which the block fills. It is removed if the block raises.

    Raises
    ------
    FileError
        If the file cannot be written. A file that existed before is left unchanged.
    """
    with writing(path):
        target = _checked_target(path, overwrite) if through_links else Path(path)
        replaced = overwrite and target.exists()
        # Private at first: others may not be allowed to read the file that is replaced.
        rights = 0o600 if replaced else 0o666
        partial = _create_partial(Path(scratch or target.parent), target.name, rights)
        try:
            yield partial
            with suppress(OSError):  # The file system may have no permissions.
                if replaced:
                    copymode(target, partial)
            _put_in_place(partial, target, overwrite)
        except FileExistsError as error:
            raise _exists(path) from error
        finally:
            with suppress(OSError):
                partial.unlink()


def _checked_target(path: str | os.PathLike[str], overwrite: bool) -> Path:
    name = os.fspath(path)
    # Checked first: realpath drops the slash that marks a folder.
    no_folder = name.endswith(os.sep) and not os.path.isdir(name)
    if not name or "\0" in name or no_folder:
        raise FileError(f"{name!r}: is not a file name; give the name of a file")
    target = Path(os.path.realpath(name))
    with suppress(FileNotFoundError):
        mode = target.stat().st_mode
        if stat.S_ISDIR(mode):
            raise FileError(f"{path}: is a directory; give the name of a file in it")
        if not stat.S_ISREG(mode):
            raise FileError(f"{path}: is not a regular file; give the name of a file")
        if not overwrite:
            raise _exists(path)
    return target


def _exists(path: str | os.PathLike[str]) -> FileError:
    return FileError(
        f"{path}: exists already; replace it with --overwrite (overwrite=True in Python) or "
        "choose another name"
    )


def _create_partial(folder: Path, name: str, mode: int = 0o666) -> Path:
    partial = folder / f".{name[:40]}.{secrets.token_hex(8)}{PARTIAL}"
    # The tempfile module would make files that only their owner can read.
    os.close(os.open(partial, os.O_CREAT | os.O_EXCL | os.O_WRONLY, mode))
    return partial


def _put_in_place(partial: Path, target: Path, overwrite: bool) -> None:
    """Give a file that is complete its name, once its content is on the disk."""
    _synchronise(partial)
    if overwrite:
        partial.replace(target)
    else:
        _rename_to_new(partial, target)
    # Not every system can synchronise a folder; the file itself is on the disk already.
    with suppress(OSError):
        _synchronise(target.parent)


def _rename_to_new(partial: Path, target: Path) -> None:
    # A rename would silently replace a file made in the meantime; a hard link fails instead.
    try:
        target.hardlink_to(partial)
    except FileExistsError:
        raise
    except OSError:
        if target.exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST)) from None
        partial.rename(target)


def _synchronise(path: Path) -> None:
    descriptor = os.open(path, _TO_SYNCHRONISE)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def append_checksum(path: Path) -> None:
    """Append the checksum line to a complete file."""
    with path.open("r+b") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
        file.seek(0, os.SEEK_END)
        file.write(_PREFIX + digest.encode() + b"\n")


def checksum_fits(path: Path) -> bool | None:
    """Return whether the checksum of a file fits its content; None if it has no checksum line.

    Other programs that change a result file drop the line, so its absence does not mean damage.
    """
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - _LENGTH))
        _, prefix, stored = file.read().rpartition(_PREFIX)
        if not prefix:
            return None
        remaining = size - len(prefix) - len(stored)
        file.seek(0)
        digest = hashlib.sha256()
        while remaining > 0 and (piece := file.read(min(_PIECE, remaining))):
            digest.update(piece)
            remaining -= len(piece)
    return stored == digest.hexdigest().encode() + b"\n"
