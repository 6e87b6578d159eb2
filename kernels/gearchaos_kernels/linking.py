"""Optimise and link a kernel once: functions linked into it are neither before that.

Numba links every function into each of its callers, and so the callers of those. Here the driver
links all functions that are compiled along with it, each of them once.

This module uses private parts of Numba. Importing it raises ImportError or AttributeError in a
version of Numba without them. Kernels are then compiled in Numba's usual way, which takes longer
and gives the same numbers up to rounding.
"""

import gc
from types import SimpleNamespace
from typing import Any

from numba.core.codegen import JITCodeLibrary, JITCPUCodegen

from gearchaos_kernels.compiler import PartCompiler

# Used below. If Numba renamed one of these, an override would be ignored or a call would fail late;
# naming them here fails at import.
_ = PartCompiler._compile_core, JITCPUCodegen._library_class
_ = JITCodeLibrary._finalize_dynamic_globals, JITCodeLibrary._ensure_finalized
_ = JITCodeLibrary.finalize, JITCodeLibrary._raise_if_finalized


class _LinkedOnly(JITCodeLibrary):  # type: ignore[misc]
    """Code of functions that only compiled code calls; the driver links and optimises it."""

    codegen = SimpleNamespace(set_env=lambda _name, _environment: None)

    def finalize(self) -> None:
        """Finish without linking, optimising or making the code executable."""
        self._raise_if_finalized()
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, _name: str) -> int:
        """Return null, as Numba does for a function that does not exist."""
        self._ensure_finalized()
        return 0


class _Driver(JITCodeLibrary):  # type: ignore[misc]
    """Code of a driver, into which all functions are linked that it calls directly or not."""

    def finalize(self) -> None:
        """Link the functions, then optimise them and make them executable."""
        # Callers first: LLVM links only functions that are called by what is there already.
        self._linking_libraries = list(reversed(_callees_first(self, {})))[1:]
        super().finalize()


def _callees_first(library: Any, found: dict[Any, None]) -> dict[Any, None]:
    """Return the libraries that a library needs, then itself; ``found``: those before it."""
    if library not in found:
        # Only these are incomplete by themselves.
        needed = library._linking_libraries if isinstance(library, _LinkedOnly | _Driver) else ()
        for one in needed:
            _callees_first(one, found)
        found[library] = None
    return found


class DriverCompiler(PartCompiler):
    """Compile a driver; functions that are compiled along with it are only linked into it."""

    def _compile_core(self) -> Any:
        """Run the passes with a `_Driver` for the driver, and `_LinkedOnly` for all others."""
        codegen = self.state.targetctx.codegen()
        codegen._library_class = _Driver
        self.state.library = codegen.create_library(self.state.func_id.func_qualname)
        self.state.library.enable_object_caching()
        codegen._library_class = _LinkedOnly
        # A compilation creates hardly any garbage before its end, so collecting only costs time.
        collecting = gc.isenabled()
        gc.disable()
        try:
            return super()._compile_core()
        finally:
            del codegen._library_class
            if collecting:
                gc.enable()
