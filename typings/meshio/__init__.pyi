from pathlib import Path
from typing import Any

from numpy.typing import NDArray

class Mesh:
    points: NDArray[Any]
    cell_data: dict[str, list[NDArray[Any]]]
    def __init__(
        self,
        points: NDArray[Any],
        cells: list[tuple[str, NDArray[Any]]],
        point_data: dict[str, NDArray[Any]] | None = ...,
        cell_data: dict[str, list[NDArray[Any]]] | None = ...,
    ) -> None: ...

def write(filename: str | Path, mesh: Mesh, **kwargs: Any) -> None: ...
def read(filename: str | Path) -> Mesh: ...
