"""Link-time optimization: compiled code is optimised and made machine code once, for each entry.

Numba does so for each function with all that it calls, and again for each that calls it: a function
at the bottom is compiled as many times as there are functions above it. Here functions stay LLVM IR
until an entry links them and optimises the whole program.
"""
from __future__ import annotations

from llvmlite.binding import ModuleRef
from numba.core.codegen import CodeLibrary, JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, PassManager, register_pass
from numba.core.typed_passes import NativeLowering


class CalledCode(JITCodeLibrary):
    """The code of a function that only other compiled code calls: LLVM IR, not optimised."""

    _linked: ModuleRef | None = None

    def finalize(self) -> None:
        """Mark the code as complete without optimising it."""
        self._finalized = True

    def _get_module_for_linking(self) -> ModuleRef:
        """The function's IR linked with that of all functions it calls, callers first: a function
        that is linked before its caller is dropped.
        """
        if self._linked is None:
            called: dict[CodeLibrary, None] = {}
            self._enter_called(called)
            self._linked = self._own().clone()
            for library in reversed(called):
                module = library._own() if isinstance(library, CalledCode) else (
                    library._get_module_for_linking())
                self._linked.link_in(module, preserve=True)
        return self._linked

    def _own(self) -> ModuleRef:
        return super()._get_module_for_linking()

    def _enter_called(self, called: dict[CodeLibrary, None]) -> None:
        """Add all that this one calls to ``called``, each after what it calls itself."""
        for library in self._linking_libraries:
            if library not in called:
                if isinstance(library, CalledCode):
                    library._enter_called(called)
                called[library] = None

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0: there is no machine code."""
        return 0

    @property
    def codegen(self) -> CalledCode:
        """The object of which numba calls set_env()."""
        return self

    def set_env(self, name: str, environment: object) -> None:
        """Do nothing: no function here has Python objects among its constants."""


@register_pass(mutates_CFG=False, analysis_only=True)
class _BeginPart(LoweringPass):
    """Compiler pass that creates the library for a function's code."""

    _name = 'begin_part'

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: object) -> bool:
        state.library = CalledCode(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return True


class PartCompiler(CompilerBase):
    """Numba's compiler, with CalledCode as the library."""

    def define_pipelines(self) -> list[PassManager]:
        """Numba's passes, with _BeginPart before the code is generated."""
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)
        place = [made for made, _ in manager.passes].index(NativeLowering)
        manager.passes.insert(place, (_BeginPart, 'begin a part'))
        manager.finalize()
        return [manager]
