"""Result files that may take minutes or gigabytes or cause a traceback, made in a few lines."""

import io
import re
import zlib
from collections.abc import Callable, Iterable
from pathlib import Path

import h5py
import numpy as np

from .fuzz_results import CHECKSUM_LINE


def forged_result(name: str, good: bytes, path: Path) -> None:
    """Write the forgery of this name, made from a sound result file over one axis."""
    path.write_bytes(good[:-CHECKSUM_LINE])
    edit, damage = FORGERIES[name]
    with h5py.File(path, "r+", track_order=True) as file:
        edit(file)
    path.write_bytes(damage(path.read_bytes()))


BOOKKEEPING = ("CLASS", "NAME", "REFERENCE_LIST", "DIMENSION_LIST", "_FillValue", "flag_values")
"""Attributes that HDF5 and netCDF read, and gearchaos does not."""


def parts_of(good: bytes) -> list[tuple[str, str]]:
    """List the datasets (name, "") and attributes (name, key) of a file, and one parameter."""
    parts: list[tuple[str, str]] = []
    with h5py.File(io.BytesIO(good)) as file:
        for name in ("/", *file, "parameters/load"):
            parts += [(name, "")] if name != "/" else []
            parts += [(name, key) for key in file[name].attrs if key not in BOOKKEEPING]
    return parts


def without(parts: Iterable[tuple[str, str]], good: bytes, path: Path) -> None:
    """Write a sound result file without some of its datasets or attributes."""
    path.write_bytes(good[:-CHECKSUM_LINE])
    with h5py.File(path, "r+") as file:
        for name, key in parts:
            if key:
                del file[name].attrs[key]
            else:
                del file[name]


def _damaged_heaps(content: bytes) -> bytes:
    # In free space of size 0 the HDF5 library would loop forever.
    place = content.index(b"GCOL") + 16
    head = b"GCOL\x01\x00\x00\x00" + (1 << 40).to_bytes(8, "little")
    within_one_another = (head + bytes([1, 0]) + bytes(14)) * 30_000
    return content[:place] + bytes(16) + content[place + 16 :] + within_one_another


def _chunk_of_no_bytes(content: bytes) -> bytes:
    with h5py.File(io.BytesIO(content)) as file:
        chunk = file["motion"].id.get_chunk_info(0)
    # Size, filter mask and offsets of the chunk along each axis precede its address.
    place = content.index(chunk.byte_offset.to_bytes(8, "little"))
    return content[: place - 24] + bytes(32) + content[place + 8 :]


def _one_heap_object(content: bytes) -> bytes:
    """Let all texts of 7 bytes refer to the one text of a million bytes."""
    place = content.index((1_000_000).to_bytes(4, "little"))
    # After the length of a text come the address of its heap and its number in the heap.
    heaps = (found.start().to_bytes(8, "little") for found in re.finditer(b"GCOL", content))
    small = re.compile(rb"\x07\0\0\0(" + b"|".join(map(re.escape, heaps)) + rb")....", re.DOTALL)
    return small.sub(lambda _: content[place : place + 16], content)


def _texts(file: h5py.File) -> None:
    file["text"] = "x" * 1_000_000
    for number in range(400):
        file[f"text {number}"] = "1234567"


def _later_words(file: h5py.File) -> None:
    for name, word, lanes in (("motion", "intermittent", [3, 4, 5]), ("status", "lost", [7])):
        words = file[name].attrs["flag_meanings"].decode().split()
        file[name][lanes] = len(words)
        file[name].attrs["flag_meanings"] = " ".join([*words, word])
        file[name].attrs["flag_values"] = np.arange(len(words) + 1, dtype="u1")
    file["period"][...] = 0
    file.attrs["schema_version"] = "3.2"


def _axis(*ends: float) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        file["load"][[0, -1] if len(ends) > 1 else -1] = ends

    return change


def _close_values(file: h5py.File) -> None:
    file["load"][...] = np.arange(file["load"].size) * 5e-324


def _symbols(depth: int, length: int) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        file["load"].attrs["symbol"] = "$" + r"\frac{" * depth + "1" + "}2" * depth + "$"
        file["section_delta_5"].attrs["symbol"] = "$" + "{" * length + "x" + "}" * length + "$"
        file["lyapunov_exponent"].attrs["symbol"] = "$" + "x^{" * depth + "x" + "}" * depth + "$"

    return change


def _long_texts(file: h5py.File) -> None:
    file.attrs["title"] = file["load"].attrs["long_name"] = "x" * 60_000
    file["load"].attrs["units"] = "$y" * 30_000
    file.create_dataset("z" * 60_000, data=np.zeros(3))


def _packed(file: h5py.File) -> None:
    chunk, number = 1 << 22, 256
    zeros = zlib.compress(bytes(chunk), 9)
    options = {"chunks": (chunk // 8,), "compression": "gzip"}
    dataset = file.create_dataset("bomb", (number * chunk // 8,), "f8", **options)
    for place in range(number):
        dataset.id.write_direct_chunk((place * chunk // 8,), zeros)


def _swelling(file: h5py.File) -> None:
    dataset = file.create_dataset("x", (8,), "f8", chunks=(8,), compression="gzip")
    dataset.id.write_direct_chunk((0,), zlib.compress(bytes(1 << 28)))


def _many_datasets(file: h5py.File) -> None:
    for number in range(10_000):
        file.id.links.create_hard(b"x%d" % number, file.id, b"status")


def _many_attributes(file: h5py.File) -> None:
    for number in range(1001):
        file["status"].attrs[f"a{number}"] = number


def _many_texts(file: h5py.File) -> None:
    file.create_dataset("x", data=["y"] * 20_000, dtype=h5py.string_dtype())


def _unwritten(file: h5py.File) -> None:
    file.create_dataset("x", (10**7,), "f8", chunks=(1,), compression="gzip")


def _nothing(_: object) -> None:
    pass


def _as_it_is(content: bytes) -> bytes:
    return content


FORGERIES: dict[str, tuple[Callable[[h5py.File], None], Callable[[bytes], bytes]]] = {
    "damaged heaps": (_nothing, _damaged_heaps),
    "many texts that refer to one heap object": (_texts, _one_heap_object),
    "20,000 texts": (_many_texts, _as_it_is),
    "a gigabyte in a megabyte": (_packed, _as_it_is),
    "a chunk that swells to 256 MB": (_swelling, _as_it_is),
    "a chunk of no bytes": (_nothing, _chunk_of_no_bytes),
    "unwritten chunks": (_unwritten, _as_it_is),
    "10,000 datasets": (_many_datasets, _as_it_is),
    "1001 attributes": (_many_attributes, _as_it_is),
    "words of a later version": (_later_words, _as_it_is),
    "an infinite axis": (_axis(np.inf), _as_it_is),
    "an axis to 1.7e308": (_axis(1.7e308), _as_it_is),
    "an axis of both signs to 1.7e308": (_axis(-1.7e308, 1.7e308), _as_it_is),
    "an axis of both signs to 1e300": (_axis(-1e300, 1e300), _as_it_is),
    "an axis of the smallest numbers": (_close_values, _as_it_is),
    "forty nested fractions": (_symbols(40, 40), _as_it_is),
    "nested symbols of sixty characters": (_symbols(7, 28), _as_it_is),
    "long texts": (_long_texts, _as_it_is),
}
