"""The source of the kernels has short functions and a documented public interface."""

import ast
import inspect
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path

import gearchaos_kernels
import pytest

MOST_LINES, MOST_ARGUMENTS = 50, 8
PUBLIC = {
    name: value
    for name, value in vars(gearchaos_kernels).items()
    if callable(value) and not name.startswith("_")
}
FUNCTIONS = [name for name, value in PUBLIC.items() if inspect.isfunction(value)]
RECORDS = {
    name: [field.name for field in fields(value)] if is_dataclass(value) else value._fields
    for name, value in PUBLIC.items()
    if is_dataclass(value) or hasattr(value, "_fields")
}


def functions() -> Iterator[tuple[str, ast.FunctionDef]]:
    """Yield every function of the kernels with the name of its file."""
    folder = Path(gearchaos_kernels.__file__).parent
    for path in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef):
                yield f"{path.relative_to(folder)}: {node.name}", node


def test_functions_are_short_and_have_few_arguments():
    found = dict(functions())
    assert len(found) > 300
    lines = {name: node.end_lineno - node.lineno + 1 for name, node in found.items()}
    arguments = {
        name: sum(isinstance(one, ast.arg) for one in ast.walk(node.args))
        for name, node in found.items()
    }
    assert {name for name, number in lines.items() if number > MOST_LINES} == set()
    assert {name for name, number in arguments.items() if number > MOST_ARGUMENTS} == set()


@pytest.mark.parametrize("name", FUNCTIONS)
def test_public_functions_document_parameters_and_results(name):
    text = inspect.getdoc(PUBLIC[name])
    given = list(inspect.signature(PUBLIC[name]).parameters)
    assert all(f"\n{parameter} : " in text for parameter in given)
    returns = inspect.signature(PUBLIC[name]).return_annotation is not None
    assert returns == ("\nReturns\n-------\n" in text)


@pytest.mark.parametrize("name", RECORDS)
def test_public_records_document_every_field(name):
    attributes = inspect.getdoc(PUBLIC[name]).partition("\nAttributes\n----------\n")[2]
    headings = [line for line in attributes.splitlines() if line and not line.startswith(" ")]
    named = {one.strip() for line in headings for one in line.partition(":")[0].split(",")}
    assert set(RECORDS[name]) <= named
