"""Optimise a kernel once: functions linked into it are not optimised or made executable before.

This module uses private parts of Numba. Importing it raises ImportError or AttributeError in a
version of Numba without them. Kernels are then compiled in Numba's usual way, which takes longer
and gives the same numbers up to rounding.
"""

import gc
from types import SimpleNamespace
from typing import Any

from llvmlite.binding import Linkage
from numba.core.base import BaseContext
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
from numba.core.dispatcher import Dispatcher

from gearchaos_kernels.compiler import PartCompiler, forget_scenes

# Used below. If Numba renamed one of these, an override would be ignored or a call would fail late;
# naming them here fails at import.
_ = PartCompiler._compile_core, JITCPUCodegen._library_class
_ = JITCodeLibrary._optimize_final_module, JITCodeLibrary._finalize_final_module
_ = JITCodeLibrary._finalize_dynamic_globals, JITCodeLibrary._ensure_finalized
_ = Dispatcher._reset_overloads, BaseContext.remove_user_function  # type: ignore[attr-defined]


class _LinkedOnly(JITCodeLibrary):  # type: ignore[misc]
    """Code of functions that only compiled code calls; the driver that links it optimises it."""

    codegen = SimpleNamespace(set_env=lambda _name, _environment: None)

    def _optimize_final_module(self) -> None:
        """Do nothing: the driver optimises this code."""

    def _finalize_final_module(self) -> None:
        """Finish without making the code executable; keep one copy, with all that it calls."""
        self._finalize_dynamic_globals()
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.external:
                function.linkage = "linkonce_odr"
        self._shared_module = self._final_module
        self._linking_libraries.clear()
        self._finalized = True

    def get_pointer_to_function(self, _name: str) -> int:
        """Return null, as Numba does for a function that does not exist."""
        self._ensure_finalized()
        return 0


class DriverCompiler(PartCompiler):
    """Compile a driver; functions that are compiled along with it are only linked into it."""

    def _compile_core(self) -> Any:
        """Run the passes with a usual library for the driver and `_LinkedOnly` for all others."""
        codegen = self.state.targetctx.codegen()
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
            # It is linked, and would keep the code of all others alive.
            self.state.library._linking_libraries.clear()
            forget_scenes()
            if collecting:
                gc.enable()
