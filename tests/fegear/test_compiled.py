"""Compiling where no cache directory can be written."""

from __future__ import annotations

from fegear.contact import compiled as module


def test_without_a_writable_cache_functions_still_compile(monkeypatch):
    original = module.njit

    def refusing(*arguments, **options):
        if options.get("cache"):
            raise RuntimeError("cannot cache function: no locator available")
        return original(*arguments, **options)

    monkeypatch.setattr(module, "njit", refusing)

    @module.compiled
    def double(x):
        return 2.0 * x

    assert double(3.0) == 6.0
    assert double.py_func(3.0) == 6.0
