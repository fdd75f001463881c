"""The exceptions of this package."""

from __future__ import annotations

from typing import Any


class Error(Exception):
    """A run that ended without a result.

    The subclass is the kind of the error, as the exit status is on the command line. Fields that
    are not known are None.
    """

    #: What is wrong, where, and what to do.
    message: str
    #: What to do, where the message does not say it.
    hint: str | None
    #: Where the geometry is wrong: coordinates.
    place: tuple[float, float, float] | None
    #: The file, or "geometry" for a text.
    file: str | None
    #: The line in the file, from 1.
    line: int | None
    #: The column in the line, from 1.
    column: int | None

    def __init__(
        self,
        message: str,
        *,
        hint: str | None = None,
        place: tuple[float, float, float] | None = None,
        file: str | None = None,
        line: int | None = None,
        column: int | None = None,
    ) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint
        self.place = place
        self.file = None if file is None else str(file)
        self.line = line
        self.column = column
        if hint is not None and hint not in message:
            # Shown with the traceback; not part of the text.
            self.__notes__ = [f"help: {hint}"]

    def __reduce__(self) -> tuple[Any, ...]:
        # Exceptions of other processes are pickled; keyword arguments are not among `args`.
        return (type(self), self.args, self.__dict__)


class InputError(Error, ValueError):
    """The input or the request is invalid; other input or other options help."""


class NoMeshError(Error):
    """No valid mesh could be made."""


class ResourceError(Error):
    """Memory, disk space, or the range of ids is insufficient."""


class RankError(Error):
    """A rank failed, or ranks cannot communicate."""


class Cancelled(Error):
    """The run was cancelled. Ctrl-C and exceptions of callbacks are raised as themselves."""


_KINDS: dict[str, type[Error]] = {
    "input": InputError,
    "no mesh": NoMeshError,
    "resources": ResourceError,
    "rank": RankError,
    "cancelled": Cancelled,
}


def error_of_kind(kind: str, message: str, fields: dict[str, Any]) -> Error:
    """The exception of an error of the library."""
    return _KINDS[kind](message, **fields)


class NoteWarning(UserWarning):
    """A message about a geometry or a run: a repair, an addition, something left out."""
