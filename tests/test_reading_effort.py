"""The code speaks the field's words; see `reading_effort`."""

from __future__ import annotations

import ast

import pytest
import reading_effort


def test_definitions_have_no_private_words():
    assert reading_effort.private_definitions() == []


def test_names_say_what_they_are():
    assert len(reading_effort.catch_alls()) <= 20


def test_a_class_name_stands_for_one_thing():
    assert len(reading_effort.repeated_classes()) <= 6


def test_no_check_vanishes_without_asserts():
    assert reading_effort.asserts() == []


def test_comments_name_constants_that_exist():
    assert reading_effort.missing_constants() == []


def test_a_constant_that_a_comment_invents_is_found():
    text = (
        'LIMIT = 1.0  # of `other.SIZE`\n\n\ndef f():\n    """At most\n    MOST."""\n'
    )
    assert list(reading_effort.missing_in(text)) == [(6, "MOST")]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("found = 1\ndef f(each, *, own):\n    known = each", "each found known own"),
        ("x = [each for each in y]", "each"),
        ("f = lambda what: what", "what"),
        ("class A:\n    kept: int\n    def words(self): ...", "kept words"),
        ("from a import found\na.given = found.asked", ""),
    ],
)
def test_bindings_are_counted_where_a_name_is_bound(text, names):
    bound = {name for name, _ in reading_effort.bindings(ast.parse(text))}
    assert " ".join(sorted(bound & reading_effort.CATCH_ALL)) == names
