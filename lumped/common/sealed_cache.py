"""Compiled code on disk, each signature in a file of its own behind its digest.

What the cache holds is used only if its digest is right, and is compiled again if not.
A full disk only costs time. It is built on parts of numba that are not public, as
`lumped.common.linking` is.
"""

from __future__ import annotations

import hashlib
import logging
import pickle
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import FunctionCache, IndexDataCacheFile

from lumped.common.linking import CACHE_FORMS, RootCompiler

DIGEST_SIZE = 32  # bytes of SHA-256 before what a file of the cache holds
LOG = logging.getLogger(__name__)


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
        return self._data_path(f"{base}.{name}.nbc")


class SealedCache(FunctionCache):
    """The cache of one function, made by one of the compilers."""

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
