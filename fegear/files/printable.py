"""Text from files and command lines made harmless for a terminal or a picture."""

from __future__ import annotations

import unicodedata

# control, format (bidirectional marks among them), surrogate, private use, separators
HARMFUL = frozenset({"Cc", "Cf", "Cs", "Co", "Zl", "Zp"})


def printable(text: str) -> str:
    r"""The text with what steers a terminal spelled out, such as \x1b and \u202e.

    Line feeds stay.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(
        repr(letter)[1:-1]
        if unicodedata.category(letter) in HARMFUL and letter != "\n"
        else letter
        for letter in text
    )
