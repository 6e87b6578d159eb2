"""Link and optimise a kernel once: its functions are not linked, optimised or executable before.

This module uses private parts of Numba. Importing it raises ImportError or AttributeError in a
version of Numba without them. Kernels are then compiled in Numba's usual way, which takes longer
and gives the same numbers up to rounding.
"""

import gc
from collections.abc import Iterable
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
_ = JITCodeLibrary.finalize, JITCodeLibrary._get_module_for_linking
_ = JITCodeLibrary._finalize_dynamic_globals, JITCodeLibrary._ensure_finalized
_ = Dispatcher._reset_overloads, BaseContext.remove_user_function  # type: ignore[attr-defined]


class _Part(JITCodeLibrary):  # type: ignore[misc]
    """Code of functions that only compiled code calls; the driver that links it optimises it."""

    codegen = SimpleNamespace(set_env=lambda _name, _environment: None)

    def finalize(self) -> None:
        """Finish without the code of the functions that it calls: the driver links them once."""
        self.called = list(self._linking_libraries)
        self._linking_libraries.clear()
        super().finalize()

    def _optimize_final_module(self) -> None:
        """Do nothing: the driver optimises this code."""

    def _finalize_final_module(self) -> None:
        """Finish without making the code executable."""
        self._finalize_dynamic_globals()
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.external:
                function.linkage = "linkonce_odr"
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        """Return the code with all that it calls, for functions that are compiled without us."""
        self._ensure_finalized()
        module = self._final_module.clone()
        for library in _callers_first(self.called):
            module.link_in(_own_module(library), preserve=True)
        return module

    def get_pointer_to_function(self, _name: str) -> int:
        """Return null, as Numba does for a function that does not exist."""
        self._ensure_finalized()
        return 0


class _Whole(JITCodeLibrary):  # type: ignore[misc]
    """Code of a driver with that of all functions that it calls, directly or not."""

    def finalize(self) -> None:
        """Link every function once, then finish as usual."""
        reloading: set[Any] = getattr(self, "_reload_init", set())  # Old versions have none.
        for library in _callers_first(self._linking_libraries):
            reloading.update(getattr(library, "_reload_init", ()))
            self._final_module.link_in(_own_module(library), preserve=True)
        self._linking_libraries.clear()
        super().finalize()


def _own_module(library: Any) -> Any:
    """Return the code of a library to link; a `_Part` comes without the functions that it calls."""
    return library._final_module if type(library) is _Part else library._get_module_for_linking()


def _callers_first(libraries: Iterable[Any]) -> list[Any]:
    """Return libraries with all that they call, each one after all those that call it.

    LLVM links functions only if code that is linked already calls them.
    """
    found: dict[Any, None] = {}

    def add(library: Any) -> None:
        if library not in found:
            for called in getattr(library, "called", ()):
                add(called)
            found[library] = None

    for library in libraries:
        add(library)
    return list(reversed(found))


class DriverCompiler(PartCompiler):
    """Compile a driver; functions that are compiled along with it are only linked into it."""

    def _compile_core(self) -> Any:
        """Run the passes with a `_Whole` for the driver and a `_Part` for all others."""
        codegen = self.state.targetctx.codegen()
        codegen._library_class = _Whole
        self.state.library = codegen.create_library(self.state.func_id.func_qualname)
        self.state.library.enable_object_caching()
        codegen._library_class = _Part
        # A compilation creates hardly any garbage before its end, so collecting only costs time.
        collecting = gc.isenabled()
        gc.disable()
        try:
            return super()._compile_core()
        finally:
            del codegen._library_class
            forget_scenes()
            if collecting:
                gc.enable()
