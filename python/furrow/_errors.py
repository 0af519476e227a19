"""Errors and warnings of the program."""

from __future__ import annotations

import argparse
import contextlib
import re
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Tuple

# Kinds of errors by the exit code of the program.
_KINDS = {1: "io", 2: "input", 75: "interrupted"}


class Place(NamedTuple):
    """Place that an error is about: a file, and line and column from 1 where they are known."""

    file: str
    line: Optional[int] = None
    column: Optional[int] = None


class FurrowError(Exception):
    """Error message of the program, or a missing or damaged part of a dataset.

    `kind` is "misuse" or "input" (the request, or a file that it names, must change), "missing" (something is not installed),
    "damaged", "io" or "interrupted". `help` states what to do, `place` where the error is; either may be `None`.
    """

    def __init__(
        self, message: str, kind: str = "input", help: Optional[str] = None, place: Optional[Place] = None
    ) -> None:
        super().__init__(message)
        self.kind, self.help, self.place = kind, help, place

    def __reduce__(self) -> Tuple[Any, ...]:
        return type(self), (str(self), self.kind, self.help, self.place)


class FurrowWarning(UserWarning):
    """Warning of the program about a scene file or an image."""


def answered(error: Dict[str, Any]) -> FurrowError:
    """Return the error that an answer of `trace serve` contains."""
    place = error["place"]
    where = None if place is None else Place(place["file"], place["line"], place["column"])
    return FurrowError(error["text"], error["kind"], error["help"], where)


def messages(text: str) -> Tuple[List[str], List[str]]:
    """Split what the program printed to stderr into warnings and errors."""
    parts = [part.strip() for part in re.split(r"(?m)^(?=warning: |error: |stopped: )", text)]
    warned = [part[len("warning: ") :] for part in parts if part.startswith("warning: ")]
    return warned, [part for part in parts if part and not part.startswith("warning: ")]


def ended(program: str, code: int, text: str) -> FurrowError:
    """Return the error of a program that ended with an exit code after printing `text`."""
    message = "\n".join(messages(text)[1]) or f"{program} ended with {code}"
    message = message[len("error: ") :] if message.startswith("error: ") else message
    found = re.match(r"([^\n]+?):(\d+):(\d+): ", message)
    place = Place(found[1], int(found[2]), int(found[3])) if found else None
    advice = re.search(r"(?m)^ help: (.*)$", message)
    return FurrowError(message, _KINDS.get(code, "io"), advice[1] if advice else None, place)


@contextlib.contextmanager
def reported(parser: argparse.ArgumentParser) -> Iterator[None]:
    """End a command line with one error and its exit code instead of a traceback."""
    try:
        yield
    except OSError as error:
        parser.exit(1, f"error: {error}\n")
    except FurrowError as error:
        parser.exit(2, f"error: {error}\n" + (f" help: {error.help}\n" if error.help else ""))
