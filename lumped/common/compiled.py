"""numba's compiler with an on-disk cache that may be unavailable.

numba keeps a compiled function while its own file is unchanged, even where a
function that it calls in another file has changed. The cache directory is
therefore named after a digest of all kernels of the folder and of the folders whose
kernels they call. Compiled code releases the interpreter's lock.

Kernels are linked as `lumped.common.linking` says by numba's internals, which are known
of the releases from OLDEST_LINKED to NEWEST_LINKED. With others, and where the variable
PLAIN_VARIABLE is set, numba compiles them in its plain way: the same numbers, of which
compiling takes several times as long.

The first compilation of a process is logged, since it takes seconds: as information,
or as a warning where its result cannot be kept.

Parts are called by other compiled functions alone, see `lumped.common.linking`.
"""

from __future__ import annotations

import hashlib
import inspect
import logging
import os
import re
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from typing import Any, Literal, TypeVar

import numba
from numba import config, njit
from numba.core import event
from numba.core.types import unliteral
from numba.extending import overload

IMPORT_LINE = re.compile(r"^from ((?:fegear|lumped)\.[\w.]+) import", re.MULTILINE)
F = TypeVar("F", bound=Callable[..., Any])
# division by zero gives inf, caught as such
COMMON_OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True}
_DISPATCHERS = set[Callable[..., Any]]()  # that are made here, whose code is kept
OLDEST_LINKED, NEWEST_LINKED = (0, 62), (0, 68)  # releases of numba
PLAIN_VARIABLE = "FEGEAR_PLAIN_KERNELS"
CACHE_SUFFIX = ".nbc"  # of code, as of numba's own cache
LOG = logging.getLogger(__name__)
Form = Literal["root", "part", "shared", "inline"]


def _release() -> tuple[int, ...]:
    """First two numbers of numba's release, of an unknown form those of none."""
    numbers = re.findall(r"\d+", numba.__version__)[:2]
    return tuple(map(int, numbers))


def is_linked() -> bool:
    """Whether kernels are linked from parts, not compiled in numba's plain way."""
    is_tested = OLDEST_LINKED <= _release() <= NEWEST_LINKED
    return is_tested and not os.environ.get(PLAIN_VARIABLE)


@cache
def kernel_cache(folder: Path) -> Path | None:
    """A writable directory for the kernels of a source folder as it is, or None."""
    digest = hashlib.sha256(b"linked" if is_linked() else b"plain")
    here = Path(__file__)
    for source in (here, here.with_name("linking.py")):
        digest.update(source.read_bytes())
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


def _compile(function: F, form: Form = "root", **options: Any) -> F:
    """Compile on first call; cache on disk where some directory can be written.

    options : of functions that are linked, besides those of their form
    """
    directory = kernel_cache(Path(inspect.getfile(function)).parent)
    if not is_linked():
        return _compile_plainly(function, directory)
    from lumped.common.linking import COMPILERS, OPTIONS
    from lumped.common.sealed_cache import SealedCache

    compiler = COMPILERS[form]
    chosen = {**COMMON_OPTIONS, **OPTIONS[form], **options, "pipeline_class": compiler}
    dispatcher = njit(**chosen)(function)
    dispatcher.get_call_template = partial(_call_template, dispatcher.get_call_template)
    _DISPATCHERS.add(dispatcher)
    if directory is None:
        return dispatcher
    with _cache_in(directory):
        dispatcher._cache = SealedCache(function, compiler)
    return dispatcher


def _compile_plainly(function: F, directory: Path | None) -> F:
    """Compile by what numba offers to all."""
    if directory is None:
        dispatcher = njit(**COMMON_OPTIONS)(function)
    else:
        with _cache_in(directory):
            dispatcher = njit(cache=True, **COMMON_OPTIONS)(function)
    _DISPATCHERS.add(dispatcher)
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
        if dispatcher in _DISPATCHERS:
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
        if not is_linked():
            LOG.warning(
                f"compiling numerical kernels in numba's plain way, a minute or more "
                f"where there is no cache: {_reason_to_be_plain()}"
            )
        elif kernel_cache(source.parent) is None:
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


def _reason_to_be_plain() -> str:
    if os.environ.get(PLAIN_VARIABLE):
        return f"{PLAIN_VARIABLE} is set"
    newest = ".".join(map(str, NEWEST_LINKED))
    return f"numba {numba.__version__} is not known, tested up to {newest}"


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
    return _compile(function, "part", _nrt=False)


def shared_part(function: F) -> F:
    """A part whose machine code all callers share: for work that is much more than the
    call, which hands over every array in several words.
    """
    return _compile(function, "shared", _nrt=False)


def inlined(function: F) -> F:
    """A part that is small and runs often: no call remains, compiling takes longer.

    Arrays are handed over in many words each, so that calls cost more than the work.
    """
    return _compile(function, "inline")


def allocating(function: F) -> F:
    """A part that makes arrays, once in a run."""
    return _compile(function, "part")


def dispatch_by_record(function: F, choices: Mapping[type, F]) -> None:
    """Let compiled code take others for `function`, by its second argument.

    choices : by the record that this is. All have the same arguments; Python calls
        `function` as it stands.
    """

    def choose(system, steps, *others):  # type: ignore[no-untyped-def]
        chosen: Any = choices[steps.instance_class]
        return chosen.py_func

    options: Any = dict(COMMON_OPTIONS)
    if is_linked():
        from lumped.common.linking import COMPILERS, OPTIONS

        options |= OPTIONS["inline"] | {"pipeline_class": COMPILERS["inline"]}
    overload(function, jit_options=options, strict=False)(choose)
