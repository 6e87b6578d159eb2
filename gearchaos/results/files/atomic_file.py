"""Files that appear complete or not at all, and tell by a checksum whether they still are.

The last line of a result file is a checksum of all that comes before it. HDF5 checks the numbers of
a dataset, but neither texts nor the bookkeeping between datasets, and damage in the latter can make
its library run forever. A line after the end of the HDF5 data disturbs no reader, and is checked
before the library sees the file.
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
"""Ending of the names of unfinished files; nothing reads them and they can be deleted."""

UNDISTURBED: int = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
"""Flags with which a file in a folder of ours is opened: no link, and no waiting for a writer."""

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
    """Word the cause of a failed operation, also where it is buried in the text of HDF5."""
    number = getattr(error, "errno", None)
    if number is None and (found := re.search(r"errno = (\d+)", str(error))):
        number = int(found[1])
    if number:
        return os.strerror(number)
    return " ".join(str(error).split()) or type(error).__name__


@contextmanager
def writing(path: str | os.PathLike[str]) -> Iterator[None]:
    """Turn whatever goes wrong while writing a file into a FileError with a remedy."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        # A full disk that HDF5 meets while it closes a file is a RuntimeError.
        if isinstance(error, RuntimeError) and "errno = " not in str(error):
            raise
        text = reason(error)
        by_text = {os.strerror(code): remedy for code, remedy in _REMEDIES.items()}
        remedy = by_text.get(text, "choose another place")
        raise FileError(f"{path}: cannot be written: {text}; {remedy}") from error


def check_output(path: str | os.PathLike[str], overwrite: bool = False) -> None:
    """Make sure that a file can be written, before anything is computed for it.

    Raises FileError if it exists and must not be overwritten, is a directory or a device, or if
    its folder is missing or cannot be written to.
    """
    with writing(path):
        target = _checked_target(path, overwrite)
        _create_partial(target.parent, target.name).unlink()


def unlinked_content(path: Path, most: int) -> bytes:
    """Read a file, unless it is a link: at most so many bytes, and without waiting for any."""
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
    """Write a file under a temporary name; it gets its own name once it is complete on the disk.

    The temporary name, of an empty file to be filled, lies in ``scratch``, a folder on the same
    file system, or beside the file, and goes away if the block raises. Without ``through_links``
    a symbolic link is replaced itself. A file that is replaced hands on its rights. Raises
    FileError if the file cannot be written; one that existed before is left as it was.
    """
    with writing(path):
        target = _checked_target(path, overwrite) if through_links else Path(path)
        replaced = overwrite and target.exists()
        # What others may not read is not shown to them half-written either.
        rights = 0o600 if replaced else 0o666
        partial = _create_partial(Path(scratch or target.parent), target.name, rights)
        try:
            yield partial
            with suppress(OSError):  # A file system without rights.
                if replaced:
                    copymode(target, partial)
            _synchronise(partial)
            if overwrite:
                partial.replace(target)
            else:
                _rename_to_new(partial, target)
            # Not every system can do this to a folder; the file itself is on the disk by now.
            with suppress(OSError):
                _synchronise(target.parent)
        except FileExistsError as error:
            raise _exists(path) from error
        finally:
            with suppress(OSError):
                partial.unlink()


def _checked_target(path: str | os.PathLike[str], overwrite: bool) -> Path:
    name = os.fspath(path)
    # realpath drops the slash that tells a folder from a file.
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
    # Not by the tempfile module: its files are readable by their owner only, and stay so.
    os.close(os.open(partial, os.O_CREAT | os.O_EXCL | os.O_WRONLY, mode))
    return partial


def _rename_to_new(partial: Path, target: Path) -> None:
    # A rename silently replaces what came to be in the meantime; a hard link does not.
    try:
        target.hardlink_to(partial)
    except FileExistsError:
        raise
    except OSError:
        if target.exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST)) from None
        partial.rename(target)


def _synchronise(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
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
    """Tell whether a file is as it was written; None if it has no checksum line.

    Other programs that change a result file drop the line, so that its absence is no damage.
    """
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - _LENGTH))
        _, prefix, told = file.read().rpartition(_PREFIX)
        if not prefix:
            return None
        remaining = size - len(prefix) - len(told)
        file.seek(0)
        digest = hashlib.sha256()
        while remaining > 0 and (piece := file.read(min(_PIECE, remaining))):
            digest.update(piece)
            remaining -= len(piece)
    return told == digest.hexdigest().encode() + b"\n"
