# The baker's module: use vps.bake and vps.Asset.surface.
from typing import Any, overload

import numpy as np
import numpy.typing as npt

@overload
def bake(file: str, settings: dict[str, Any], cache: str) -> tuple[npt.NDArray[np.uint8], list[str]]: ...
@overload
def bake(
    vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int64], settings: dict[str, Any], cache: str
) -> tuple[npt.NDArray[np.uint8], list[str]]: ...
def surface(
    asset: Any, scale: float, step: float | None
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]: ...
