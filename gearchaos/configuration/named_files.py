"""Files that a configuration names: their text, and columns of CSV text."""

import csv
import os
import re
from collections.abc import Iterator
from math import isfinite

from gearchaos.configuration.messages import NUMBER, Fault, shown
from gearchaos.configuration.toml_text import text_of_file
from gearchaos.errors import GearchaosError


def text_beside(folder: str | None, name: str, what: str) -> str:
    """Read the text of a file in the folder of the configuration.

    ``what``: name of the file in messages. Without a folder nothing is read: a stored
    configuration must not open files. Raises ValueError with rule and remedy.
    """
    if folder is None:
        rule = "is not kept under [files], and other files are not read here"
        raise ValueError(rule, "run the sweep again, or read the configuration with load_config")
    path = os.path.join(folder, name)
    try:
        return text_of_file(path, what)
    except GearchaosError as fault:
        # The fault names the file.
        raise ValueError(str(fault).removeprefix(f"{path}: ")) from None


def fault_of(key: str, error: Exception, name: str) -> Fault:
    """Return the fault of a file as a fault of the key that names it."""
    rule, remedy = [*map(str, error.args), ""][:2]
    return Fault(key, rule, remedy, name)


class CsvText:
    """Columns of CSV text below a line of headings.

    Columns are separated by comma, semicolon or tab. Lines that begin with ``#`` are notes. The
    line of headings is the first one, or the first one with a given heading: inspection sheets
    begin with lines about the gear.

    Parameters
    ----------
    text : str
        The text.
    decimal_comma : bool
        Whether decimals may have a comma where columns are separated by semicolons or tabs.
    heading : object
        A heading in the line of headings, if it is known.

    Attributes
    ----------
    headings : list of str
        The headings.
    """

    def __init__(self, text: str, *, decimal_comma: bool = False, heading: object = None) -> None:
        # Notes become empty lines, and empty lines are no rows.
        lines = [re.sub(r"^\s*(#.*)?$", "", line) for line in text.splitlines()]
        at = next((n for n, line in enumerate(lines) if _has(line, heading)), 0)
        lines[:at] = [""] * at
        headline = next(filter(None, lines), "")
        delimiter = next((mark for mark in ";\t," if mark in headline), ",")
        self._decimal_comma = decimal_comma and delimiter != ","
        reader = csv.reader(lines, delimiter=delimiter)
        self._rows = [(reader.line_num, [*map(str.strip, row)]) for row in reader if row]
        self.headings = self._rows.pop(0)[1] if self._rows else []
        # Without empty cells at the end of a line.
        self._cells_in = {
            line: max((n for n, cell in enumerate(row, 1) if cell), default=0)
            for line, row in self._rows
        }

    def column(self, name: object, whose: str = "") -> list[float]:
        """Return the numbers of a column; ValueError with rule and remedy if there are none.

        Empty cells at the end do not count. ``whose``: what has one number, in messages.
        """
        return list(self._numbers(self._cells(name), str(name), whose))

    def numbered_column(self, name: object, numbers: str, whose: str) -> list[float]:
        """Return the numbers of a column in the order of the whole numbers in another column.

        These must be 0 to n - 1 or 1 to n, each once, in any order. Rows before the first one and
        after the last one of them are notes. Raises ValueError with rule and remedy.
        """
        order, cells = dict(self._cells(numbers)), dict(self._cells(name))
        lines = [line for line, _ in self._rows]
        whole = [re.fullmatch(r"\d{1,6}", order.get(line, "")) is not None for line in lines]
        first = whole.index(True) if True in whole else len(lines)
        last = next((n for n in range(first, len(lines)) if not whole[n]), len(lines))
        used = [line for line in lines[first:last] if line in cells]
        places = [int(order[line]) for line in used]
        begin = min(min(places, default=0), 1)
        expected = range(begin, begin + len(used))
        if sorted(places) != [*expected]:
            wrong = next(n for n in expected if places.count(n) != 1)
            state = "missing" if wrong not in places else "there more than once"
            rule = f"column {numbers}: must hold 0 to n - 1 or 1 to n, each once"
            raise ValueError(f"{rule}, and {wrong} is {state}", "correct it")
        values = self._numbers([(line, cells[line]) for line in used], str(name), whose)
        return [value for _, value in sorted(zip(places, values, strict=True))]

    def _cells(self, name: object) -> list[tuple[int, str]]:
        """Return line and text of the cells of a column, without empty ones at its end."""
        if name not in self.headings:
            if not self.headings:
                raise ValueError("is empty", "give a line of headings and the rows below it")
            asked = "column is missing" if name is None else f"has no column {shown(name)}"
            # Content is never quoted: the path may lead to any file of this machine.
            raise ValueError(asked, "name one of its headings; capitals count")
        if self.headings.count(str(name)) > 1:
            raise ValueError(f"has several columns {shown(name)}", "rename all but one of them")
        place = self.headings.index(str(name))
        cells = [(line, "".join(row[place : place + 1])) for line, row in self._rows]
        while cells and not cells[-1][1]:
            cells.pop()
        return cells

    def _numbers(self, cells: list[tuple[int, str]], name: str, whose: str) -> Iterator[float]:
        """Yield the cells of a column as numbers."""
        for line, cell in cells:
            if self._cells_in[line] > len(self.headings):
                # A decimal comma would cut the number, and move the cells after it.
                rule = f"line {line}: has {self._cells_in[line]} cells below {len(self.headings)} "
                remedy = "correct it; decimals with a comma need semicolons between the columns"
                raise ValueError(f"{rule}headings", remedy)
            text = cell.replace(",", ".") if self._decimal_comma else cell
            if not (NUMBER.fullmatch(text) and isfinite(float(text))):
                found = "" if text else ", and the cell is empty"
                rule = f"line {line}, column {name}: must be a finite number{found}"
                mark = "a point or a comma" if self._decimal_comma else "a point"
                raise ValueError(rule, f"give one for every {whose}, decimals with {mark}")
            yield float(text)


def _has(line: str, heading: object) -> bool:
    """Whether a line has a heading among its columns."""
    return isinstance(heading, str) and any(
        heading in (cell.strip().strip('"') for cell in line.split(mark)) for mark in ";\t,"
    )
