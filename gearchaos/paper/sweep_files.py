"""Where the ready-to-run configurations lie: in the installed package, or in the clone."""

from pathlib import Path

from gearchaos.errors import FileError

_PACKAGE = Path(__file__).resolve().parents[1]
_FOLDERS = (_PACKAGE / "sweeps", _PACKAGE.parent / "sweeps")


def sweep_file(name: str) -> Path:
    """Return the path of a configuration that comes with gearchaos, such as ``pan2021.toml``.

    Raises FileError if neither the installed package nor the clone has it.
    """
    for folder in _FOLDERS:
        if (folder / name).is_file():
            return folder / name
    places = " nor ".join(str(folder) for folder in _FOLDERS)
    raise FileError(f"{name}: is neither in {places}; install gearchaos again")
