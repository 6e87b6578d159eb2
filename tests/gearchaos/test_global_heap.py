"""A file in which the HDF5 library would walk in circles is refused before it starts."""

import time

import pytest

from gearchaos.errors import FileError
from gearchaos.results.checksum_line import append_checksum
from gearchaos.results.global_heap import heaps_end
from gearchaos.results.result import open_result

from .fuzz_results import CHECKSUM_LINE, good_result


@pytest.mark.parametrize("checksum", [False, True])
def test_free_space_of_no_size_in_a_heap_is_refused(checksum, tmp_path):
    path = tmp_path / "circle.h5"
    good_result(path)
    assert heaps_end(path)
    content = bytearray(path.read_bytes()[:-CHECKSUM_LINE])
    first_object = content.index(b"GCOL") + 16
    content[first_object : first_object + 16] = bytes(16)
    path.write_bytes(content)
    if checksum:
        append_checksum(path)
    assert not heaps_end(path)
    with pytest.raises(FileError, match="is damaged where its texts are kept; run the sweep again"):
        open_result(path)


def test_collections_within_one_another_are_refused_at_once(tmp_path):
    # Each claims all that follows: walking every one of them would take a quadratic time.
    path = tmp_path / "nested.h5"
    head = b"GCOL\x01\x00\x00\x00" + (1 << 40).to_bytes(8, "little")
    path.write_bytes((head + bytes([1, 0]) + bytes(14)) * 200_000)
    began = time.perf_counter()
    assert not heaps_end(path)
    assert time.perf_counter() - began < 2.0


def test_every_result_has_a_heap_that_ends(tmp_path):
    # The lists of dimension scales, without which the file is no netCDF-4, have variable lengths.
    good_result(tmp_path / "good.h5")
    assert b"GCOL" in (tmp_path / "good.h5").read_bytes()
    assert heaps_end(tmp_path / "good.h5")
