"""Docstrings below the declarations of keys, read only when a text needs them."""

import ast
import inspect
from functools import cache
from itertools import pairwise
from textwrap import dedent


@cache
def docstrings_of(declared: type) -> dict[str, str]:
    """Return the docstrings below the attributes of a class by name, without inherited ones.

    Reading the source of all tables takes longer than making the tables. Only error messages and
    the documentation need it.
    """
    try:
        (body,) = ast.parse(dedent(inspect.getsource(declared))).body
    except (OSError, TypeError):
        # A class that was made without source has no docstrings.
        return {}
    assert isinstance(body, ast.ClassDef)
    return {
        one.target.id: inspect.cleandoc(other.value.value)
        for one, other in pairwise(body.body)
        if isinstance(one, ast.AnnAssign)
        and isinstance(one.target, ast.Name)
        and isinstance(other, ast.Expr)
        and isinstance(other.value, ast.Constant)
        and isinstance(other.value.value, str)
    }


def docstring_of(model: type, attribute: str) -> str:
    """Return the docstring below an attribute of a class or of its bases; empty without one."""
    for base in model.__mro__:
        if attribute in vars(base).get("__annotations__", ()):
            return docstrings_of(base).get(attribute, "")
    return ""
