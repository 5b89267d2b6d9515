"""What a renderer costs at a given error, from runs at a few settings. Standard library only."""

import dataclasses
import math


@dataclasses.dataclass
class CostAt:
    cost: float  # [s]
    kind: str  # measured, interpolated, extrapolated


def front(points):
    """Of (error, cost) pairs those that no other beats in both, by rising error and so falling cost."""
    kept = []
    for error, cost in sorted(points):
        if not kept or cost < kept[-1][1]:
            kept.append((error, cost))
    return kept


def cost_at(error, points):
    """Least cost of an error of at most `error`, from (error, cost) pairs, or None where no run is that good. Between
    two runs the logarithm of the cost is linear in that of the error; beyond the coarsest, that run counts."""
    kept = front(points)
    if not kept or error < kept[0][0]:
        return None
    for (fine_error, fine_cost), (coarse_error, coarse_cost) in zip(kept, kept[1:]):
        if error < coarse_error:
            if error == fine_error:
                return CostAt(fine_cost, "measured")
            part = math.log(error / fine_error) / math.log(coarse_error / fine_error)
            return CostAt(math.exp((1 - part) * math.log(fine_cost) + part * math.log(coarse_cost)), "interpolated")
    return CostAt(kept[-1][1], "measured")


def path_cost_at(error, points):
    """The same for a path tracer, whose error falls with the square root of its paths: beyond its finest run the cost
    is extrapolated so."""
    kept = front(points)
    if kept and error < kept[0][0]:
        return CostAt(kept[0][1] * (kept[0][0] / error) ** 2, "extrapolated")
    return cost_at(error, points)
