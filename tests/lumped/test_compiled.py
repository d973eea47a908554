"""Where compiled kernels are kept."""

from __future__ import annotations

from pathlib import Path

import pytest
from numba import config
from numba.core import event

from lumped import compiled as module

FOLDER = Path(module.__file__).parent / "kernels"


@pytest.fixture
def fresh():
    module.kernel_cache.cache_clear()
    yield
    module.kernel_cache.cache_clear()


def test_without_a_writable_cache_functions_still_compile(monkeypatch):
    monkeypatch.setattr(module, "kernel_cache", lambda folder: None)

    @module.compiled
    def double(x):
        return 2.0 * x

    assert double(3.0) == 6.0
    assert double.py_func(3.0) == 6.0


def test_no_place_is_no_error(monkeypatch, fresh):
    def refuse(*_, **__):
        raise PermissionError

    monkeypatch.setattr(Path, "mkdir", refuse)
    assert module.kernel_cache(FOLDER) is None


def test_directory_follows_the_sources(monkeypatch, tmp_path, fresh):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    one = module.kernel_cache(FOLDER)
    module.kernel_cache.cache_clear()
    original = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: original(path) + b"#")
    assert module.kernel_cache(FOLDER) != one
    assert one.parent == tmp_path


def test_other_users_of_numba_keep_their_cache_directory():
    before = config.CACHE_DIR
    with module._cache_in(Path("/elsewhere")):
        assert config.CACHE_DIR == "/elsewhere"
    assert before == config.CACHE_DIR


@pytest.mark.parametrize(("kept", "level"), [(True, "INFO"), (False, "WARNING")])
def test_the_first_compilation_is_said_once(monkeypatch, caplog, kept, level):
    if not kept:
        monkeypatch.setattr(module, "kernel_cache", lambda folder: None)
    watch = module._FirstUse()
    event.register("numba:compile", watch)
    caplog.set_level("INFO", "lumped")
    try:
        for factor in (2.0, 3.0):
            module.njit(lambda x, factor=factor: factor * x)(1.0)
    finally:
        event.unregister("numba:compile", watch)
    said = [r for r in caplog.records if "compiling numerical kernels" in r.message]
    assert [r.levelname for r in said][:1] == [level]
    assert len(said) <= 2  # the process's own watch may speak as well


def test_a_mode_of_contact_is_compiled_once():
    """A plain int as an argument would compile the whole chain for each value."""
    from fegear.contact.active_set import STE, TORQUE

    @module.njit
    def kind_of(kind):
        return kind

    for kind in (TORQUE, STE):
        kind_of(kind)
    assert len(kind_of.signatures) == 1
    assert not isinstance(TORQUE, int)
