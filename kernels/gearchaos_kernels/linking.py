"""Compile a kernel once: what it is linked from is neither optimised nor made executable.

Numba keeps to itself what this uses. Importing this module raises ImportError or AttributeError
where a version of Numba lacks some of it: kernels are then compiled in Numba's own way, which takes
longer and gives the same numbers up to rounding.
"""

import gc
from types import SimpleNamespace
from typing import Any

from numba.core.codegen import JITCodeLibrary, JITCPUCodegen

from gearchaos_kernels.compiler import PartCompiler

# Overridden or called below. If Numba renamed one, the override would be ignored, or a call would
# fail late; this fails at import.
_ = PartCompiler._compile_core, JITCPUCodegen._library_class
_ = JITCodeLibrary._optimize_final_module, JITCodeLibrary._finalize_final_module
_ = JITCodeLibrary._finalize_dynamic_globals, JITCodeLibrary._ensure_finalized


class _LinkedOnly(JITCodeLibrary):  # type: ignore[misc]
    """Code of functions that no Python calls: a driver that they are linked into optimises it."""

    codegen = SimpleNamespace(set_env=lambda _name, _environment: None)

    def _optimize_final_module(self) -> None:
        """Leave it to the driver."""

    def _finalize_final_module(self) -> None:
        """Make nothing executable."""
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, _name: str) -> int:
        """Return null, as where there is no such function."""
        self._ensure_finalized()
        return 0


class DriverCompiler(PartCompiler):
    """Compile a driver; everything that is compiled on its way is only linked into it."""

    def _compile_core(self) -> Any:
        """Run the passes with a library for the driver, and another kind for all others."""
        codegen = self.state.targetctx.codegen()
        self.state.library = codegen.create_library(self.state.func_id.func_qualname)
        self.state.library.enable_object_caching()
        codegen._library_class = _LinkedOnly
        # Next to nothing of what a compilation makes is rubbish before its end.
        collecting = gc.isenabled()
        gc.disable()
        try:
            return super()._compile_core()
        finally:
            del codegen._library_class
            if collecting:
                gc.enable()
