"""How compiled functions are put together from parts.

numba makes machine code of every function, and also links its optimised code into each
function that calls it, where it is optimised and made machine code again. A part is
linked alone, without machine code of its own; a shared part has machine code alone, to
which its callers jump, in memory and when they are loaded from the cache.
"""

from __future__ import annotations

import hashlib
from importlib import import_module
from typing import Any

from llvmlite import binding
from numba._dynfunc import make_function
from numba.core import compiler, itanium_mangler
from numba.core.caching import CompileResultCacheImpl
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.typed_passes import NativeLowering


class _Library(JITCodeLibrary):
    """Code that knows the shared parts that it calls.

    shared : module, function and types of the arguments, by name in machine code
    """

    def __init__(self, codegen: Any, name: str) -> None:
        super().__init__(codegen, name)
        self.shared: dict[str, tuple[str, str, Any]] = {}

    def add_linking_library(self, library: Any) -> None:
        super().add_linking_library(library)
        self.shared |= getattr(library, "shared", {})


class _PartLibrary(_Library):
    """Optimised code for the functions that call it, without machine code."""

    def _finalize_final_module(self) -> None:
        """Leave out machine code."""
        self._finalize_dynamic_globals()
        self._finalized = True

    def _optimize_final_module(self) -> None:
        """Optimise once: twice is for functions that count references."""
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)

    def add_llvm_module(self, ll_module: Any) -> None:
        """Link without numba's passes over each function, as the module has its own."""
        ll_module.data_layout = self._codegen._data_layout
        self._final_module.link_in(ll_module)

    def serialize_using_object_code(self) -> tuple[str, str, bytes]:
        """Return what numba keeps in its cache: of a part no object code."""
        saved: tuple[str, str, bytes] = self.serialize_using_bitcode()
        return saved


class _InlineLibrary(_PartLibrary):
    """Code that becomes that of the functions that call it, and is optimised there."""

    def _optimize_final_module(self) -> None:
        """Nothing is done."""

    def add_llvm_module(self, ll_module: Any) -> None:
        self._optimize_functions(ll_module)
        self._final_module.link_in(ll_module)


class _SharedLibrary(_Library):
    """Machine code, to which those that call it have its name alone."""

    def _get_module_for_linking(self) -> Any:
        self._ensure_finalized()
        if self._shared_module is None:
            nothing = self._codegen._create_empty_module(self.name)
            self._shared_module = binding.parse_assembly(str(nothing))
        return self._shared_module


@register_pass(mutates_CFG=True, analysis_only=False)
class _LinkPart(LoweringPass):
    """Offers a part to the functions that call it."""

    _name = "link_part"

    def __init__(self) -> None:
        LoweringPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        lowered, library = state.cr, state.library
        library._ensure_finalized()
        function = _uncallable(library, lowered.fndesc, lowered.env)
        state.targetctx.insert_user_function(function, lowered.fndesc, [library])
        state.reload_init.extend(getattr(library, "_reload_init", ()))
        state.cr = lowered._replace(cfunc=function)
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class _NamePart(LoweringPass):
    """Makes a shared part known by its name."""

    _name = "name_part"

    def __init__(self) -> None:
        LoweringPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        description = state.cr.fndesc
        place = description.modname, description.qualname, tuple(state.args)
        state.library.shared[description.llvm_func_name] = place
        return False


def _uncallable(library: _PartLibrary, description: Any, environment: Any) -> Any:
    """Return what numba's tables hold for a part; Python cannot call it."""
    name = description.qualname.split(".")[-1]
    module = description.lookup_module()
    return make_function(module, name, "part", 0, environment, (library,))


class RootCompiler(compiler.CompilerBase):
    """Compiles functions that Python calls."""

    library_class: type[_Library] = _Library

    def define_pipelines(self) -> list[Any]:
        state = self.state
        state.library = self.library_class(
            state.targetctx.codegen(), state.func_id.func_qualname
        )
        state.library.enable_object_caching()
        passes = compiler.DefaultPassBuilder.define_nopython_pipeline(state)
        self.change(passes)
        passes.finalize()
        return [passes]

    def change(self, passes: Any) -> None:
        """Nothing is changed."""


class PartCompiler(RootCompiler):
    """Compiles parts that are linked into the functions that call them."""

    library_class = _PartLibrary

    def change(self, passes: Any) -> None:
        self.state.flags.no_compile = True
        passes.add_pass_after(_LinkPart, NativeLowering)


class InlineCompiler(PartCompiler):
    """Compiles parts that become code of the functions that call them."""

    library_class = _InlineLibrary


class SharedCompiler(RootCompiler):
    """Compiles shared parts, which have the same name in all processes."""

    library_class = _SharedLibrary

    def change(self, passes: Any) -> None:
        self.state.targetctx.mangler = _lasting_name
        passes.add_pass_after(_NamePart, NativeLowering)


def _lasting_name(
    name: str, argtypes: Any, *, abi_tags: Any = (), uid: int | None = None
) -> str:
    """A name in machine code without numba's numbers, which processes give anew."""
    types = hashlib.sha256(repr(tuple(argtypes)).encode()).hexdigest()[:16]
    return str(itanium_mangler.mangle(name, (), abi_tags=(types,)))


class _RootCache(CompileResultCacheImpl):
    """Machine code, and the shared parts that have to be there before it is loaded."""

    def reduce(self, cres: Any) -> Any:
        name = cres.fndesc.llvm_func_name
        shared = {k: v for k, v in cres.library.shared.items() if k != name}
        return shared, super().reduce(cres)

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """Return the function, or None where a shared part has another name."""
        shared, saved = payload
        for name, (module, function, types) in shared.items():
            dispatcher = getattr(import_module(module), function)
            dispatcher.compile(types)
            if dispatcher.overloads[types].fndesc.llvm_func_name != name:
                return None
        cres = self.load(target_context, saved)
        cres.library.shared = shared
        return cres

    def load(self, target_context: Any, saved: Any) -> Any:
        """Return the function without those."""
        return super().rebuild(target_context, saved)


class _SharedCache(_RootCache):
    """Machine code that itself is a shared part."""

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        cres = super().rebuild(target_context, payload)
        if cres is not None:
            name, types = cres.fndesc.llvm_func_name, tuple(cres.signature.args)
            place = cres.fndesc.modname, cres.fndesc.qualname, types
            cres.library.shared = cres.library.shared | {name: place}
        return cres


class _PartCache(_RootCache):
    """Optimised code."""

    def load(self, target_context: Any, saved: Any) -> Any:
        (name, _, bitcode), description, environment, signature, *_, reloads, _ = saved
        library = _PartLibrary(target_context.codegen(), name)
        library._final_module = binding.parse_bitcode(bitcode)
        library._finalized = True
        return compiler.compile_result(
            typing_context=target_context.typing_context,
            target_context=target_context,
            library=library,
            environment=environment,
            entry_point=_uncallable(library, description, environment),
            fndesc=description,
            signature=signature,
            objectmode=False,
            lifted=(),
            reload_init=reloads,
        )


CACHE_FORMS: dict[type[RootCompiler], type[_RootCache]] = {
    RootCompiler: _RootCache,
    PartCompiler: _PartCache,
    InlineCompiler: _PartCache,
    SharedCompiler: _SharedCache,
}

PART_OPTIONS = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
COMPILERS: dict[str, type[RootCompiler]] = {
    "root": RootCompiler,
    "part": PartCompiler,
    "shared": SharedCompiler,
    "inline": InlineCompiler,
}
OPTIONS: dict[str, dict[str, Any]] = {
    "root": {},
    "part": PART_OPTIONS,
    "shared": PART_OPTIONS,
    "inline": PART_OPTIONS | {"_nrt": False, "forceinline": True},
}
