"""A file in which the HDF5 library would walk in circles is refused before it starts."""

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
