"""What compiled code calls is optimised and made machine code once, with what Python calls.

Numba does so for each function with all that it calls, and again for each that calls it: a function
at the bottom is compiled as many times as there are functions above it. Here functions stay as they
were written until an entry links them, as a linker does that optimises the whole program.
"""
from __future__ import annotations

from llvmlite.binding import ModuleRef
from numba.core.codegen import CodeLibrary, JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, PassManager, register_pass
from numba.core.typed_passes import NativeLowering


class CalledCode(JITCodeLibrary):
    """The code of a function that only other compiled code calls."""

    _linked: ModuleRef | None = None

    def finalize(self) -> None:
        """Leave it as it is."""
        self._finalized = True

    def _get_module_for_linking(self) -> ModuleRef:
        """The function with all that it calls: what calls first, then what is called, as what is
        linked before anything calls it is left out.
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
        """Enter all that is called, each after all that it calls itself."""
        for library in self._linking_libraries:
            if library not in called:
                if isinstance(library, CalledCode):
                    library._enter_called(called)
                called[library] = None

    def get_pointer_to_function(self, name: str) -> int:
        """None: there is no machine code."""
        return 0

    @property
    def codegen(self) -> CalledCode:
        """Whom numba asks to set_env()."""
        return self

    def set_env(self, name: str, environment: object) -> None:
        """Nothing to set: no function here has Python objects among its constants."""


@register_pass(mutates_CFG=False, analysis_only=True)
class _BeginPart(LoweringPass):
    """Makes the library that a function's code is entered into."""

    _name = 'begin_part'

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: object) -> bool:
        state.library = CalledCode(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return True


class PartCompiler(CompilerBase):
    """Numba's own, but for the library."""

    def define_pipelines(self) -> list[PassManager]:
        """The passes in their order."""
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)
        place = [made for made, _ in manager.passes].index(NativeLowering)
        manager.passes.insert(place, (_BeginPart, 'begin a part'))
        manager.finalize()
        return [manager]
