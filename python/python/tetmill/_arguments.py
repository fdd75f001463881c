"""Checks of arguments: what is wrong with an array or a number, in one sentence."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def positions(name: str, values: ArrayLike, width: int = 3) -> NDArray[np.float64]:
    """Rows of finite numbers, as float64 in C order; without a copy if they are that already."""
    array = np.asarray(values)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} must be numbers, not {array.dtype}")
    if array.ndim != 2 or array.shape[1] != width:
        raise ValueError(f"{name} must have the shape (n, {width}), not {array.shape}")
    array = np.ascontiguousarray(array, dtype=np.float64)
    if not np.isfinite(array).all():
        row = int(np.flatnonzero(~np.isfinite(array).all(axis=1))[0])
        raise ValueError(f"{name}[{row}] is not finite: {array[row].tolist()}")
    return array


def _unsigned(name: str, values: ArrayLike, least: int) -> NDArray[np.uint32]:
    array = np.asarray(values)
    if array.size == 0:
        array = array.astype(np.uint32)
    if array.dtype.kind not in "iu":
        raise TypeError(f"{name} must be integers, not {array.dtype}")
    if array.size and (int(array.min()) < least or int(array.max()) > 2**31 - 1):
        wrong = array.flat[int(np.argmax((array < least) | (array > 2**31 - 1)))]
        raise ValueError(f"{name} has the value {int(wrong)}: possible are {least} to {2**31 - 1}")
    return np.ascontiguousarray(array, dtype=np.uint32)


def indices(name: str, values: ArrayLike, width: int, count: int) -> NDArray[np.uint32]:
    """Rows of indices of `count` points."""
    array = _unsigned(name, values, 0)
    if array.size == 0:
        array = array.reshape(0, width)
    if array.ndim != 2 or array.shape[1] != width:
        raise ValueError(f"{name} must have the shape (n, {width}), not {array.shape}")
    if array.size and int(array.max()) >= count:
        row = int(np.flatnonzero((array >= count).any(axis=1))[0])
        raise ValueError(f"{name}[{row}] is {array[row].tolist()}, but there are {count} points")
    return array


def numbers(name: str, values: ArrayLike | None, count: int) -> NDArray[np.uint32]:
    """One number from 1 for each of `count` elements; an empty array for None."""
    if values is None:
        return np.empty(0, dtype=np.uint32)
    array = _unsigned(name, values, 1)
    if array.shape != (count,):
        raise ValueError(f"{name} must have the shape ({count},), not {array.shape}")
    return array


def names(name: str, values: dict[int, str] | None) -> dict[int, str]:
    """Names by number."""
    for number, text in (values or {}).items():
        if not isinstance(text, str) or isinstance(number, bool) or not isinstance(number, (int, np.integer)):
            raise TypeError(f"{name} must map integers to strings, not {number!r} to {text!r}")
        if number < 1:
            raise ValueError(f"{name} has the number {number}: numbers are positive")
    return {int(number): text for number, text in (values or {}).items()}


def length(name: str, value: float | None, zero: bool = False) -> float | None:
    """A positive finite number, or 0 if that is allowed."""
    if value is None:
        return None
    if isinstance(value, (bool, str)):
        raise TypeError(f"{name} must be a number, not {value!r}")
    number = float(value)
    if math.isfinite(number) and (number > 0 or (zero and number == 0)):
        return number
    raise ValueError(f"{name} cannot be {value}: expected a {'number from 0' if zero else 'positive number'}")


def count(name: str, value: float | None) -> int | None:
    """A positive integer, also written as 1e9."""
    if value is None:
        return None
    if isinstance(value, (bool, str)):
        raise TypeError(f"{name} must be a number, not {value!r}")
    if not 1 <= value < 9e15:
        raise ValueError(f"{name} cannot be {value}: expected a count such as 50000 or 1e9")
    return round(value)


def whole(name: str, value: int, least: int, most: int) -> int:
    """An integer in a range."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise TypeError(f"{name} must be an integer, not {value!r}")
    if not least <= value <= most:
        raise ValueError(f"{name} cannot be {value}: possible are {least} to {most}")
    return int(value)


def one_of(name: str, value: str, known: Iterable[str]) -> str:
    """One of several words."""
    known = list(known)
    if value not in known:
        raise ValueError(f"{name} cannot be {value!r}: possible are {', '.join(known)}")
    return value


def as_dict(text: str) -> Any:
    """JSON of the library."""
    import json

    return json.loads(text)
