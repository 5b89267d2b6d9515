"""Blender's world (Z up) as glTF's (Y up)."""

from __future__ import annotations

from typing import Any, List, Sequence

Matrix = Sequence[Sequence[float]]


def up_rows(matrix: Any) -> List[List[float]]:
    """Rows of a 4 x 4 matrix whose result is turned to Y up: (x, y, z) becomes (x, z, -y)."""
    x, y, z, w = ([float(matrix[row][column]) for column in range(4)] for row in range(4))
    return [x, z, [-value for value in y], w]


def columns(rows: Matrix) -> List[float]:
    """16 values column by column, as glTF and the wire have them."""
    return [rows[row][column] for column in range(4) for row in range(4)]


def rigid(rows: Matrix) -> List[List[float]]:
    """Turn and place without scale or shear; looking along -Z stays."""

    def unit(v: Sequence[float]) -> List[float]:
        length = sum(value * value for value in v) ** 0.5
        if not length > 0.0:
            raise ValueError("a camera that is scaled to nothing")
        return [value / length for value in v]

    def cross(a: Sequence[float], b: Sequence[float]) -> List[float]:
        return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]

    back = unit([rows[i][2] for i in range(3)])
    right = unit(cross([rows[i][1] for i in range(3)], back))
    up = cross(back, right)
    return [[right[i], up[i], back[i], rows[i][3]] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]]
