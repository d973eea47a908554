"""The one error a user's input may cause."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from fegear.files.printable import printable

MAX_WORD_LENGTH, MAX_MESSAGE_LENGTH = 500, 4000  # letters


class InputError(ValueError):
    """What a user gave cannot be used; the message is one line for a reader.

    It names where the input came from, the field, what arrived and what is allowed. It
    is a ValueError.

    Parameters
    ----------
    message : str
        Message, of which line ends become spaces, very long parts are shortened and
        control characters are spelled out.
    """

    def __init__(self, message: str) -> None:
        super().__init__(printable(one_line(message)))


class NoResultError(InputError):
    """What was computed gives no result, so that resuming would not help either.

    Parameters
    ----------
    message : str
        Message, as of an `InputError`.
    """


def one_line(message: str) -> str:
    """A message for a reader: one line, without the middle of what is very long."""
    shortened = (_shortened_text(word, MAX_WORD_LENGTH) for word in message.split())
    return _shortened_text(" ".join(shortened), MAX_MESSAGE_LENGTH)


def _shortened_text(text: str, longest: int) -> str:
    if len(text) <= longest:
        return text
    return f"{text[: longest // 2]}...{text[-longest // 4 :]}"


def file_error(
    path: str | os.PathLike[str], deed: str, error: OSError | ValueError
) -> InputError:
    """`path: cannot be read, permission denied`; deed : what cannot be done.

    error : of the system, or a ValueError for a null byte in the path
    """
    reason = getattr(error, "strerror", None) or str(error)
    if "requested and" in reason:  # as numpy says it
        reason = "there is no room for all of it"
    return InputError(f"{os.fspath(path)}: cannot be {deed}, {reason.lower()}")


@contextmanager
def refused_foreign_errors(path: str | os.PathLike[str], kind: str) -> Iterator[None]:
    """Around a library that reads a file of another program, which may be damaged.

    Whatever it makes of bytes that are no such file becomes an InputError.

    kind : what it should be, such as an HDF5 file, without its article
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except Exception:
        text = f"{os.fspath(path)}: is no {kind}, or damaged"
        raise InputError(text) from None


def nearest(word: str, choices: Iterable[str]) -> str:
    """', did you mean x?' or nothing."""
    from difflib import get_close_matches

    matches = get_close_matches(word, list(choices), n=1, cutoff=0.6)
    return f", did you mean {matches[0]}?" if matches else ""
