"""numba's compiler with an on-disk cache that may be unavailable.

numba reuses a compiled function as long as its own file is unchanged, even if a
function that it calls in another file has changed. The cache directory is
therefore named after a digest of all kernels of the folder and of the folders whose
kernels they call. Compiled code releases the interpreter's lock.

The contents of the cache are used only if their digest is correct, and are compiled
again otherwise. A full disk only costs time.

The first compilation of a process is logged, since it takes seconds: as information,
or as a warning if its result cannot be cached.
"""

from __future__ import annotations

import hashlib
import inspect
import logging
import os
import pickle
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from numba import config, njit
from numba.core import event
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.extending import overload

IMPORTED = re.compile(r"^from ((?:fegear|lumped)\.[\w.]+) import", re.MULTILINE)
F = TypeVar("F", bound=Callable[..., Any])
PART = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
DIGEST = 32  # bytes of SHA-256 before the contents of a cache file
INLINED = {**PART, "_nrt": False, "forceinline": True}
LOG = logging.getLogger(__name__)


@cache
def kernel_cache(folder: Path) -> Path | None:
    """Writable cache directory for the kernels of a source folder, or None."""
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for path in sorted({p for f in (folder, *_called(folder)) for p in f.glob("*.py")}):
        digest.update(path.read_bytes())
    name = f"kernels-{digest.hexdigest()[:16]}"
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    places = [Path(chosen)] if chosen else []
    for place in [*places, folder / "__pycache__", Path.home() / ".cache" / "fegear"]:
        directory = place / name
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(directory, os.W_OK):
            return directory
    return None


def _called(folder: Path) -> set[Path]:
    """Other folders from which the kernels of a folder import."""
    top = folder.parents[len(_package(folder)) - 1]
    found = set()
    for path in folder.glob("*.py"):
        text = path.read_text(encoding="utf-8")
        if "from lumped.common.compiled import" in text:
            found |= {
                top.joinpath(*name.split(".")[:-1]) for name in IMPORTED.findall(text)
            }
    return found - {folder, Path(__file__).parent}


def _package(folder: Path) -> list[str]:
    """Names of the packages down to a folder."""
    names = [folder.name]
    while (folder.parent / "__init__.py").exists():
        folder = folder.parent
        names.insert(0, folder.name)
    return names


@contextmanager
def _cache_in(directory: Path) -> Iterator[None]:
    settings: Any = config  # its attributes are created on import
    before = settings.CACHE_DIR
    settings.CACHE_DIR = str(directory)
    try:
        yield
    finally:
        settings.CACHE_DIR = before


class _SealedFile(IndexDataCacheFile):
    """Index and code of one function, each preceded by its digest."""

    def _load_index(self) -> dict[Any, str]:
        version, stamp, found = self._read(self._index_path) or (None, None, {})
        own = self._version, self._source_stamp
        return found if (version, stamp) == own else {}

    def _save_index(self, overloads: dict[Any, str]) -> None:
        self._write(self._index_path, (self._version, self._source_stamp, overloads))

    def _load_data(self, name: str) -> Any:
        return self._read(self._data_path(name))

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), data)

    def _read(self, path: str) -> Any:
        """Values in a file, or None if it is missing or damaged."""
        try:
            content = Path(path).read_bytes()
        except OSError:
            return None
        seal, data = content[:DIGEST], content[DIGEST:]
        if hashlib.sha256(data).digest() == seal:
            return pickle.loads(data)
        _say_damaged(Path(path).parent)
        return None

    def _write(self, path: str, values: Any) -> None:
        data = self._dump(values)
        with suppress(OSError), self._open_for_write(path) as file:
            file.write(hashlib.sha256(data).digest() + data)


class _SealedCache(FunctionCache):
    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        file = self._cache_file
        base = self._impl.filename_base
        self._cache_file = _SealedFile(file._cache_path, base, file._source_stamp)


@cache
def _say_damaged(directory: Path) -> None:
    LOG.warning(f"{directory}: compiled kernels are damaged and compiled again")


def _compile(function: F, **options: Any) -> F:
    options["error_model"] = "numpy"  # division by zero gives inf, caught as such
    options["nogil"] = True
    directory = kernel_cache(Path(inspect.getfile(function)).parent)
    if directory is None:
        return njit(**options)(function)
    dispatcher = njit(**options)(function)
    with _cache_in(directory):
        dispatcher._cache = _SealedCache(function)
    return dispatcher


class _FirstUse(event.Listener):
    """Logs once that a function is compiled because it is not in the cache."""

    def __init__(self) -> None:
        self.silent = False

    def on_start(self, event: event.Event) -> None:
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
        """Do nothing."""


event.register("numba:compile", _FirstUse())


def compiled(function: F) -> F:
    """Compile on first call, and cache on disk if a directory is writable."""
    return _compile(function)


def compiled_part(function: F) -> F:
    """Compile for use in other compiled functions only, in half the time.

    Parts neither create nor return arrays, so that numba need not count references:
    an atomic operation whenever an array is read from a record, which is most of the
    work of a small step. Python calls a part uncompiled as `function.py_func`.
    """
    return _compile(function, _nrt=False, **PART)


def inlined(function: F) -> F:
    """Compile a small, frequently called part inline, at the cost of compile time.

    Each array is passed in many words, so that a call costs more than the work.
    """
    return _compile(function, **INLINED)


def allocating(function: F) -> F:
    """Compile a part that creates arrays, called once in a run."""
    return _compile(function, **PART)


def chosen_by_record(function: F, choices: Mapping[type, F]) -> None:
    """Replace `function` in compiled code according to its second argument.

    choices : replacements by the record type of that argument. All have the same
        arguments; Python calls `function` itself.
    """

    def choose(system, steps, *others):  # type: ignore[no-untyped-def]
        chosen: Any = choices[steps.instance_class]
        return chosen.py_func

    options: Any = {**INLINED, "error_model": "numpy", "nogil": True}
    overload(function, jit_options=options, strict=False)(choose)
