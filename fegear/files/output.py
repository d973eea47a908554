"""Read text; write files that appear whole or not at all; JSON for machines.

Files are written under a temporary name, which is locked, and then renamed. A
process that is killed leaves it there without a lock; the next one that writes to the
same directory removes it. Process numbers would not do: they are not unique
between containers and on network drives.
"""

from __future__ import annotations

import contextlib
import math
import os
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from typing import Any

from fegear.files.errors import InputError, file_error

try:
    import fcntl
except ImportError:  # on Windows, where a file that is open cannot be removed
    fcntl = None  # type: ignore[assignment]

# Name of a file that is being written; some letters follow
TEMPORARY_PREFIX = ".fegear-{process}-"
TEMPORARY_NAME = re.compile(r"\.fegear-\d+-\w+(\.\w+)?")
INTERACTIVE = ".html"  # ending of a picture that a reader zooms into
PICTURES = (".png", ".pdf", ".svg", INTERACTIVE)  # endings of names
SPREADSHEET = ".xlsx"
FMU = ".fmu"  # ending of a functional mock-up unit
TABLE_FORMATS = (".csv", ".mat", ".nc", SPREADSHEET)
TABLES = (*TABLE_FORMATS, ".txt", "")  # endings of names, as CSV where they say nothing
SINGLE_TABLES = tuple(kind for kind in TABLES if kind != ".nc")  # of a whole result
EXCEL_NEEDED = "a spreadsheet needs openpyxl: pip install 'fegear[excel]'"
HDF5 = ".h5"
HDF5_NEEDED = "HDF5 needs h5py: pip install 'fegear[hdf5]'"
TDMS_NEEDED = "a TDMS file needs npTDMS: pip install 'fegear[tdms]'"
FMU_NEEDED = "an FMU needs pythonfmu: pip install 'fegear[fmu]'"
PLOTLY_NEEDED = "an interactive figure needs plotly: pip install 'fegear[interactive]'"
MAX_READ_BYTES = 2**30  # of a file that is read as a whole
MAX_STREAM_BYTES = 2**26  # of a pipe or a device, which may have no end
LONGEST_SUFFIX = 8  # letters of the name that the temporary name repeats
# Files that a command reads, which nothing it writes may replace
PROTECTED_INPUTS: ContextVar[frozenset[Any]] = ContextVar("INPUTS", default=frozenset())


def listed(endings: Sequence[str]) -> str:
    """Endings in words, without the empty one: .png, .pdf or .svg."""
    *others, last = filter(None, endings)
    return f"{', '.join(others)} or {last}" if others else last


# for a help text, after what is drawn or written
INTO_PICTURE = f"into this file, {listed(PICTURES)}"
TO_TABLE = f"to this file, {listed(TABLE_FORMATS)}"
TO_SINGLE_TABLE = f"to this file, {listed(SINGLE_TABLES[:-2])}"


def read_content(
    path: str | os.PathLike[str], max_bytes: int = MAX_READ_BYTES
) -> bytes:
    """All bytes of a file; InputError where it cannot be read or holds too many."""
    try:
        with open(path, "rb") as file:
            if not os.path.isfile(path):
                max_bytes = min(max_bytes, MAX_STREAM_BYTES)
            content = file.read(max_bytes + 1)
    except (OSError, ValueError) as error:
        raise file_error(path, "read", error) from None
    except MemoryError:
        raise InputError(f"{os.fspath(path)}: too large for the memory") from None
    if len(content) > max_bytes:
        raise InputError(f"{os.fspath(path)}: larger than {max_bytes // 2**20} MiB")
    return content


def read_text(path: str | os.PathLike[str]) -> str:
    """UTF-8 text, without a byte-order mark; raises InputError naming the file."""
    try:
        return read_content(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path}: not UTF-8 text, byte {error.start} is "
            f"0x{error.object[error.start]:02x}"
        ) from None


@contextlib.contextmanager
def protected_inputs(paths: Iterable[str | os.PathLike[str]]) -> Iterator[None]:
    """Refuse to replace these files, by whatever path, while the context lasts."""
    token = PROTECTED_INPUTS.set(
        PROTECTED_INPUTS.get() | {file_identity(path) for path in paths}
    )
    try:
        yield
    finally:
        PROTECTED_INPUTS.reset(token)


def require_no_input(path: str | os.PathLike[str]) -> None:
    """Raise InputError for a file that the command reads."""
    if file_identity(path) in PROTECTED_INPUTS.get():
        raise taken_error(path)


def taken_error(path: str | os.PathLike[str]) -> InputError:
    """Why a file is not written."""
    return InputError(f"{path}: is read or written already by this command")


def file_identity(path: str | os.PathLike[str]) -> Any:
    """A value that all paths of a file share, those of links to it among them."""
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return os.path.realpath(path)
    return status.st_dev, status.st_ino


def require_writable(path: str | os.PathLike[str]) -> Path:
    """The path, if a file can be written there; nothing is left behind.

    Raises InputError otherwise, so that no work is done for nothing.
    """
    target = Path(path)
    if os.path.isdir(target):
        raise InputError(f"{target}: is a directory, a file name is needed")
    if is_device(target):
        return target
    require_no_input(target)
    try:
        with contextlib.suppress(FileNotFoundError):
            os.lstat(target)  # raises for a name that is too long
        if os.path.exists(target) and not os.access(target, os.W_OK):
            raise PermissionError("permission denied")
        with _temporary_file_beside(target):
            pass
    except (OSError, ValueError) as error:
        raise file_error(target, "written", error) from None
    return target


def path_of(path: object) -> Path:
    """The path of a file; InputError for what is none."""
    if isinstance(path, str | os.PathLike):
        return Path(path)
    raise InputError(f"path = {path!r}; must be text or a path")


def require_picture(path: Path) -> None:
    """A file whose ending says what kind of picture it is, or a device.

    Raises InputError otherwise, and for an interactive one without plotly.
    """
    kind = path.suffix.lower()
    if kind not in PICTURES and not is_device(path):
        allowed = ", ".join(PICTURES)
        raise InputError(f"{path}: a picture's name must end in {allowed}")
    if kind == INTERACTIVE and not has_plotly():
        raise InputError(f"{path}: {PLOTLY_NEEDED}")


def require_ending(path: Path | None, allowed: Sequence[str] = TABLES) -> None:
    """A file whose ending says what it holds, a device, or none.

    Raises InputError otherwise, and where the package is missing that it needs.
    """
    if path is None or is_device(path):
        return
    kind = path.suffix.lower()
    if kind not in allowed:
        raise InputError(f"{path}: the file's name must end in {listed(allowed)}")
    if kind == SPREADSHEET and not has_package("openpyxl"):
        raise InputError(f"{path}: {EXCEL_NEEDED}")
    if kind == FMU and not has_package("pythonfmu"):
        raise InputError(f"{path}: {FMU_NEEDED}")
    if kind == HDF5 and not has_package("h5py"):
        raise InputError(f"{path}: {HDF5_NEEDED}")


def has_plotly() -> bool:
    """Whether plotly is installed, which draws interactive figures."""
    return has_package("plotly")


def has_package(name: str) -> bool:
    """Whether a package that is not always needed is installed."""
    from importlib.util import find_spec

    return find_spec(name) is not None


def make_directory(path: str | os.PathLike[str]) -> Path:
    """The directory, made with its parents; InputError where that is not possible."""
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise file_error(path, "made", error) from None
    return Path(path)


def write_whole(path: str | os.PathLike[str], writer: Callable[[Path], object]) -> None:
    """Let `writer` fill a file next to `path`, then move it into place.

    That file has the suffix of `path`. If the writer fails, `path` is as it
    was. Raises InputError where the file cannot be written.
    """
    target = Path(path)
    try:
        if is_device(target):
            writer(target)
        else:
            require_no_input(target)
            _fill_and_replace(target, writer)
    except OSError as error:
        raise file_error(target, "written", error) from None


def write_bytes(path: str | os.PathLike[str], content: bytes) -> None:
    """Write a whole content; see `write_whole`."""
    write_whole(path, lambda place: place.write_bytes(content))


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a whole text as it is, line ends too; see `write_whole`."""
    write_bytes(path, text.encode())


def strict_json(values: Mapping[str, Any]) -> str:
    """JSON without NaN: what is not finite becomes null."""
    import json

    text = json.dumps(_with_null_for_infinite(values), indent=2, allow_nan=False) + "\n"
    # DEL is the one control character that json does not escape
    return text.replace("\x7f", "\\u007f")


def _with_null_for_infinite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _with_null_for_infinite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_with_null_for_infinite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def is_device(target: Path) -> bool:
    """/dev/stdout and the like, which are written to as they are."""
    return os.path.exists(target) and not (
        os.path.isfile(target) or os.path.isdir(target)
    )


def _fill_and_replace(target: Path, writer: Callable[[Path], object]) -> None:
    with _temporary_file_beside(target) as temporary:
        writer(temporary)
        temporary.chmod(_permissions_for(target))
        os.replace(temporary, target)


@contextlib.contextmanager
def _temporary_file_beside(target: Path) -> Iterator[Path]:
    """Create an empty file in the same directory, so that renaming is atomic.

    It is locked, and removed at the end unless it was renamed.
    """
    _remove_abandoned_files(target.parent.absolute())
    handle, temporary = _locked_file(target)
    try:
        if fcntl is None:
            os.close(handle)
        yield temporary
    finally:
        temporary.unlink(missing_ok=True)
        if fcntl is not None:
            os.close(handle)


def _locked_file(target: Path) -> tuple[int, Path]:
    while True:
        handle, name = tempfile.mkstemp(
            suffix=target.suffix if len(target.suffix) <= LONGEST_SUFFIX else None,
            prefix=TEMPORARY_PREFIX.format(process=os.getpid()),
            dir=target.parent,
        )
        if fcntl is None:
            return handle, Path(name)
        # one that has found it before it is locked removes it and then lets go of it;
        # on a drive without locks nobody does
        with contextlib.suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        if os.path.exists(name):
            return handle, Path(name)
        os.close(handle)


@cache
def _remove_abandoned_files(directory: Path) -> None:
    """Remove temporary files of processes that are gone, once for each directory."""
    with contextlib.suppress(OSError), os.scandir(directory) as entries:
        for entry in entries:
            if TEMPORARY_NAME.fullmatch(entry.name):
                with contextlib.suppress(OSError):
                    _remove_abandoned(entry.path)


def _remove_abandoned(path: str) -> None:
    if fcntl is None:
        os.unlink(path)
        return
    handle = os.open(path, os.O_RDWR)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.unlink(path)
    finally:
        os.close(handle)


def _permissions_for(target: Path) -> int:
    """Permissions of the file that is replaced, or those a new file would get."""
    if target.exists():
        return target.stat().st_mode & 0o777
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask
