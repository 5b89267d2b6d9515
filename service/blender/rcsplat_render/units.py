"""Blender's lamps in the units of rcsplat: radiant intensity [W/sr], irradiance [W/m^2], radiance [W/(m^2 sr)].

Before Blender 4.0 (`old`) area lamps shone with P / 4A, and spots with the cosine to their axis: seen in 3.4's Cycles.
"""

from __future__ import annotations

import math
from typing import Callable, List, Tuple

# Of which a blended spot is made. The sum follows Blender's fade to 0.6 % of the full intensity.
SPOT_STEPS = 12
# ... and of which the fade inside of it, where there is one.
INNER_STEPS = 6


def point_intensity(watts: float) -> float:
    """Of a point or spot lamp, [W/sr]: Blender's watts are those of a lamp that shines everywhere."""
    return watts / (4.0 * math.pi)


def area_radiance(watts: float, area: float, old: bool = False) -> float:
    """Of a flat lamp that shines from one side."""
    return watts / ((4.0 if old else math.pi) * area)


def sphere_radiance(watts: float, surface: float) -> float:
    """Of a closed surface that shines outwards."""
    return watts / (math.pi * surface)


def lamp_area(shape: str, width: float, height: float) -> float:
    """[m^2] of Blender's SQUARE, RECTANGLE, DISK and ELLIPSE."""
    return width * height * (math.pi / 4.0 if shape in ("DISK", "ELLIPSE") else 1.0)


def spot_cones(size: float, blend: float, old: bool = False) -> List[Tuple[float, float, float]]:
    """(share, inner, outer) of spots that together fade as Blender's: half angles [rad]; the shares' sum is 1.

    With u from 0 at the cone's edge to 1 at its axis, linear in the cosine, glTF's lamps fade with min(1, u / w)^2, w
    from their two angles. Those of all w sum up to f(u) where those between w and w + dw have the share -w^2 dG, with
    G(w) = f'(w) / 2w, and the one of w = 1 the rest, f'(1) / 2. f is Blender's smoothstep over `blend`, times the
    cosine in old ones.
    """
    outer = 0.5 * size
    edge = math.cos(outer)
    soft = blend if (1.0 - edge) * blend >= 1e-4 else 0.0
    f, slope = _fade(edge, soft, old)
    cones = [(f(0.0), max(0.0, outer - 1e-3), outer)] if f(0.0) > 0.0 else []
    bounds = [soft * i / SPOT_STEPS for i in range(SPOT_STEPS)] if soft > 0.0 else []
    inner = range(INNER_STEPS if old and soft < 1.0 else 1)
    bounds += [soft + (1.0 - soft) * (i / INNER_STEPS) ** 2 for i in inner]
    bounds += [1.0] if bounds[-1] < 1.0 else []
    for low, high in zip(bounds, bounds[1:]):
        share = 0.5 * (low * slope(low) - high * slope(high)) + f(high) - f(low)
        if share > 1e-9:  # less than 0 in old spots of more than 150 degrees: they come out a few % too bright
            # One spot's edge, so that the slope's integral stays what it is.
            width = math.sqrt(share / max(share, _g(slope, low) - _g(slope, high)))
            cones.append((share, math.acos(min(1.0, edge + width * (1.0 - edge))), outer))
    if slope(1.0) > 0.0:
        cones.append((0.5 * slope(1.0), 0.0, outer))
    return cones


def _fade(edge: float, soft: float, old: bool) -> Tuple[Callable[[float], float], Callable[[float], float]]:
    """Of a spot whose edge has that cosine: what part of the full intensity is there at u, and its slope."""
    def step(u: float) -> float:
        t = u / soft if u < soft else 1.0
        return t * t * (3.0 - 2.0 * t)

    def steepness(u: float) -> float:
        return 6.0 * u / soft * (1.0 - u / soft) / soft if u < soft else 0.0

    def cosine(u: float) -> float:
        return edge + (1.0 - edge) * u if old else 1.0

    def slope(u: float) -> float:
        return cosine(u) * steepness(u) + ((1.0 - edge) * step(u) if old else 0.0)

    return lambda u: cosine(u) * step(u), slope


def _g(slope: Callable[[float], float], u: float) -> float:
    low = max(u, 1e-9)
    return 0.5 * slope(low) / low
