"""The one error a user's input may cause."""

from __future__ import annotations


class InputError(ValueError):
    """What a user gave cannot be used; the message is one line for a reader.

    It names where the input came from, the field, what arrived and what is allowed.
    """

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))
