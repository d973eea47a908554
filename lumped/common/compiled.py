"""numba's compiler with an on-disk cache that may be unavailable.

numba keeps a compiled function while its own file is unchanged, even where a
function that it calls in another file has changed. The cache directory is
therefore named after a digest of all kernels of the folder and of the folders whose
kernels they call. Compiled code releases the interpreter's lock.

What the cache holds is used only if its digest is right, and is compiled again if not.
A full disk only costs time.

The first compilation of a process is logged, since it takes seconds: as information,
or as a warning where its result cannot be kept.

Parts are called by other compiled functions alone, see `lumped.common.linking`.
"""

from __future__ import annotations

import hashlib
import inspect
import logging
import os
import pickle
import re
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeVar

from numba import config, njit
from numba.core import event
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.types import unliteral
from numba.extending import overload

from lumped.common import linking
from lumped.common.linking import (
    CACHE_FORMS,
    InlineCompiler,
    PartCompiler,
    RootCompiler,
    SharedCompiler,
)

IMPORT_LINE = re.compile(r"^from ((?:fegear|lumped)\.[\w.]+) import", re.MULTILINE)
F = TypeVar("F", bound=Callable[..., Any])
DIGEST_SIZE = 32  # bytes of SHA-256 before what a file of the cache holds
CACHE_SUFFIX = ".nbc"
PART_OPTIONS = {
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "pipeline_class": PartCompiler,
}
INLINE_OPTIONS = PART_OPTIONS | {
    "pipeline_class": InlineCompiler,
    "_nrt": False,
    "forceinline": True,
}
LOG = logging.getLogger(__name__)


@cache
def kernel_cache(folder: Path) -> Path | None:
    """A writable directory for the kernels of a source folder as it is, or None."""
    digest = hashlib.sha256(Path(__file__).read_bytes())
    digest.update(Path(linking.__file__).read_bytes())
    for path in sorted(
        {p for f in (folder, *_imported_folders(folder)) for p in f.glob("*.py")}
    ):
        digest.update(path.read_bytes())
    name = f"kernels-{digest.hexdigest()[:16]}"
    cache_dir = os.environ.get("NUMBA_CACHE_DIR")
    parents = [Path(cache_dir)] if cache_dir else []
    for parent in [*parents, folder / "__pycache__", Path.home() / ".cache" / "fegear"]:
        directory = parent / name
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(directory, os.W_OK):
            return directory
    return None


def _imported_folders(folder: Path) -> set[Path]:
    """Other folders from which the kernels of a folder import."""
    top = folder.parents[len(_package_names(folder)) - 1]
    folders = set()
    for path in folder.glob("*.py"):
        text = path.read_text(encoding="utf-8")
        if "from lumped.common.compiled import" in text:
            folders |= {
                top.joinpath(*name.split(".")[:-1])
                for name in IMPORT_LINE.findall(text)
            }
    return folders - {folder, Path(__file__).parent}


def _package_names(folder: Path) -> list[str]:
    """Return the names of the packages down to a folder."""
    names = [folder.name]
    while (folder.parent / "__init__.py").exists():
        folder = folder.parent
        names.insert(0, folder.name)
    return names


@contextmanager
def _cache_in(directory: Path) -> Iterator[None]:
    settings: Any = config  # its attributes are made when it is imported
    previous_dir = settings.CACHE_DIR
    settings.CACHE_DIR = str(directory)
    try:
        yield
    finally:
        settings.CACHE_DIR = previous_dir


class _SealedFiles(IndexDataCacheFile):
    """Code of a function, each signature in a file of its own behind its digest.

    Processes that compile at once then cannot overwrite what others have added, as in
    numba's index of all signatures. The directory's name holds the sources' digest.
    """

    def save(self, key: Any, data: Any) -> None:
        path, content = self._path(key), self._dump((key, data))
        with suppress(OSError), self._open_for_write(path) as file:
            file.write(hashlib.sha256(content).digest() + content)

    def load(self, key: Any) -> Any:
        """Return the saved code, or None if there is none or it is damaged."""
        path = Path(self._path(key))
        try:
            content = path.read_bytes()
        except OSError:
            return None
        digest, content = content[:DIGEST_SIZE], content[DIGEST_SIZE:]
        if hashlib.sha256(content).digest() != digest:
            _warn_damaged(path.parent)
            return None
        saved_key, data = pickle.loads(content)
        return data if saved_key == key else None

    def _path(self, key: Any) -> str:
        name = hashlib.sha256(repr((self._version, key)).encode()).hexdigest()[:16]
        base = self._index_name.removesuffix(".nbi")
        return self._data_path(f"{base}.{name}{CACHE_SUFFIX}")


class _SealedCache(FunctionCache):
    def __init__(
        self, function: Callable[..., Any], compiler: type[RootCompiler]
    ) -> None:
        self._impl_class = CACHE_FORMS[compiler]
        super().__init__(function)
        base, stamp = self._impl.filename_base, None
        self._cache_file = _SealedFiles(self._cache_path, base, stamp)


@cache
def _warn_damaged(directory: Path) -> None:
    LOG.warning(f"{directory}: compiled kernels are damaged and compiled again")


def _compile(function: F, **options: Any) -> F:
    options["error_model"] = "numpy"  # division by zero gives inf, caught as such
    options["nogil"] = True
    compiler = options.setdefault("pipeline_class", RootCompiler)
    dispatcher = njit(**options)(function)
    dispatcher.get_call_template = partial(_call_template, dispatcher.get_call_template)
    directory = kernel_cache(Path(inspect.getfile(function)).parent)
    if directory is None:
        return dispatcher
    with _cache_in(directory):
        dispatcher._cache = _SealedCache(function, compiler)
    return dispatcher


def _call_template(get_template: Callable[..., Any], args: Any, kws: Any) -> Any:
    """How other compiled code calls a function: with constants as with variables.

    numba would compile it again for every constant among the arguments.
    """
    variables = {name: unliteral(kind) for name, kind in kws.items()}
    return get_template([unliteral(kind) for kind in args], variables)


class CompileCount(event.Listener):
    """Counts the kernels that this process compiles in a `with` block.

    names : of functions with the types of their arguments; processes that run at once
        may compile the same ones, of which the cache keeps one
    """

    def __init__(self) -> None:
        self.names = set[str]()

    @property
    def signatures(self) -> int:
        return len(self.names)

    def __enter__(self) -> CompileCount:
        event.register("numba:compile", self)
        return self

    def __exit__(self, *_: object) -> None:
        event.unregister("numba:compile", self)

    def on_start(self, event: event.Event) -> None:
        """Nothing is done."""

    def on_end(self, event: event.Event) -> None:
        dispatcher = event.data["dispatcher"]
        if isinstance(dispatcher._cache, _SealedCache):
            function = dispatcher.py_func
            name = f"{function.__module__}.{function.__qualname__}"
            line = function.__code__.co_firstlineno
            self.names.add(f"{name}:{line} {event.data['args']}")


class CompileClock(event.Listener):
    """Logs once that a kernel is compiled and was not found in the cache, and counts
    the time that compiling takes.

    seconds : spent on it in this process; one kernel compiles others on the way
    """

    def __init__(self) -> None:
        self.silent = False
        self.seconds = 0.0
        self._begun = threading.local()

    def on_start(self, event: event.Event) -> None:
        depth = getattr(self._begun, "depth", 0)
        if depth == 0:
            self._begun.time = time.perf_counter()
        self._begun.depth = depth + 1
        self._announce(event)

    def _announce(self, event: event.Event) -> None:
        if self.silent:
            return
        self.silent = True
        source = Path(inspect.getfile(event.data["dispatcher"].py_func))
        if kernel_cache(source.parent) is None:
            LOG.warning(
                "compiling numerical kernels, 5 s to a minute at every start: no cache "
                "directory can be written, set NUMBA_CACHE_DIR to one that can"
            )
        else:
            LOG.info("compiling numerical kernels for the first use, 5 s to a minute")

    def on_end(self, event: event.Event) -> None:
        self._begun.depth -= 1
        if self._begun.depth == 0:
            self.seconds += time.perf_counter() - self._begun.time


CLOCK = CompileClock()
event.register("numba:compile", CLOCK)


def compiled(function: F) -> F:
    """Compile on first call; cache on disk where some directory can be written."""
    return _compile(function)


def not_allocating(function: F) -> F:
    """Compile as `compiled` does a function that makes and returns no arrays."""
    return _compile(function, _nrt=False)


def compiled_part(function: F) -> F:
    """Compile for use in other compiled functions only, in half the time.

    Parts make and return no arrays, so that numba need not count references to them:
    an atomic operation wherever an array is taken out of a record, which is most of
    the work of a small step. Python calls a part uncompiled as `function.py_func`.
    """
    return _compile(function, _nrt=False, **PART_OPTIONS)


def shared_part(function: F) -> F:
    """A part whose machine code all callers share: for work that is much more than the
    call, which hands over every array in several words.
    """
    return _compile(
        function, **PART_OPTIONS | {"pipeline_class": SharedCompiler, "_nrt": False}
    )


def inlined(function: F) -> F:
    """A part that is small and runs often: no call remains, compiling takes longer.

    Arrays are handed over in many words each, so that calls cost more than the work.
    """
    return _compile(function, **INLINE_OPTIONS)


def allocating(function: F) -> F:
    """A part that makes arrays, once in a run."""
    return _compile(function, **PART_OPTIONS)


def dispatch_by_record(function: F, choices: Mapping[type, F]) -> None:
    """Let compiled code take others for `function`, by its second argument.

    choices : by the record that this is. All have the same arguments; Python calls
        `function` as it stands.
    """

    def choose(system, steps, *others):  # type: ignore[no-untyped-def]
        chosen: Any = choices[steps.instance_class]
        return chosen.py_func

    options: Any = {**INLINE_OPTIONS, "error_model": "numpy", "nogil": True}
    overload(function, jit_options=options, strict=False)(choose)
