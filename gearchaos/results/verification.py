"""Every checksum of a result file, tried: that of the file and those of its arrays' chunks."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import h5py

from gearchaos.errors import FileError
from gearchaos.results.checksum_line import checksum_fits
from gearchaos.results.result_file import PARAMETERS
from gearchaos.results.result_reader import read_result
from gearchaos.results.stored_dataset import datasets_of


def verify(path: str | os.PathLike[str]) -> list[str]:
    """Read all of a result file, piece by piece, and say what was found sound, a phrase each.

    Raises FileError if anything is damaged or contradicts the format; it names arrays and rows.
    """
    try:
        variables, _, parameters, metadata = read_result(path, rows=False)
    except FileError as error:
        raise FileError([*error.problems, *damaged_pieces(path)]) from error
    # Of a large file the reader has not tried the checksum.
    fits = checksum_fits(Path(path))
    damage = f"{path}: is damaged (its checksum does not fit); run the sweep again"
    if problems := [*([damage] if fits is False else []), *damaged_pieces(path)]:
        raise FileError(problems)
    with h5py.File(path, "r") as file:
        datasets = datasets_of(file).values()
        summed = sum(dataset.id.get_num_chunks() for dataset in datasets if dataset.fletcher32)
    foreign = "there is no checksum of the file: another program than gearchaos has written to it"
    return [
        foreign if fits is None else "the checksum of the file fits",
        f"{summed} chunks of numbers fit their checksums",
        f"format {metadata['schema']} {metadata['schema_version']}: {len(variables)} variables and "
        f"{len(parameters)} {PARAMETERS} have their types, dimensions and sizes",
    ]


def damaged_pieces(path: str | os.PathLike[str]) -> Iterator[str]:
    """Name the arrays, and the rows of them, that cannot be read; one sentence each."""
    # Where the damage has reached further, the reader has said so already.
    if Path(path).is_file():
        with suppress(Exception), h5py.File(path, "r") as file:
            for name, dataset in datasets_of(file).items():
                for piece in dataset.iter_chunks() if dataset.chunks else [()]:
                    try:
                        dataset[piece]
                    except OSError:
                        rows = f", rows {piece[0].start} to {piece[0].stop - 1}" if piece else ""
                        yield f"{path}: is damaged in {name}{rows}"
