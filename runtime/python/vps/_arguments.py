# SPDX-License-Identifier: Zlib
"""Arguments of users: what is wrong with one is said in a line that names it."""
from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def number(name: str, value: Any) -> Any:
    """`value`, if it is a real number, or an array of one without dimensions."""
    if isinstance(value, np.ndarray) and value.shape == () and value.dtype.kind in "fiu":
        return value[()]
    if not isinstance(value, (int, float, np.integer, np.floating)):
        raise TypeError(f"{name}: a number, not {value!r}")
    return value


def at_least_0(name: str, value: Any) -> Any:
    """`value`, if it is a finite number that is not negative."""
    if not 0 <= number(name, value) < np.inf:
        raise ValueError(f"{name}: finite and at least 0, not {value!r}")
    return value


def whole(name: str, value: Any, least: int, most: int) -> int:
    """`value`, if it is a whole number of this range."""
    if not isinstance(value, (int, np.integer)):
        raise TypeError(f"{name}: a whole number, not {value!r}")
    if not least <= value <= most:
        raise ValueError(f"{name}: {least} to {most}, not {value}")
    return int(value)


def numbers(name: str, value: npt.ArrayLike, last: tuple[int, ...]) -> Array:
    """`value` as an array of real numbers whose last dimensions are `last`."""
    array = np.asarray(value)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: numbers are needed, not {array.dtype}")
    if last and array.shape[-len(last):] != last:
        raise ValueError(f"{name}: the shape is (..., {', '.join(map(str, last))}), not {array.shape}")
    return array


def one_array(name: str, value: npt.ArrayLike, shape: tuple[int, ...]) -> Array:
    """`value` as one array of this shape, finite in single precision."""
    array = np.asarray(numbers(name, value, shape), np.float64)
    if array.shape != shape:
        raise ValueError(f"{name}: the shape is {shape}, not {array.shape}")
    if not np.all(np.abs(array) <= np.finfo(np.float32).max):
        raise ValueError(f"{name}: finite in single precision")
    return array
