"""Markdown of the runs and of the costs at equal error. Standard library only."""

import datetime
import os
import platform

import equal_error

MARKS = {"measured": "", "interpolated": " ~", "extrapolated": " ^"}


def machine():
    """One line: processor, cores, system, today's date."""
    model = platform.processor() or platform.machine()
    try:
        with open("/proc/cpuinfo") as file:
            model = next(line.split(":", 1)[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        pass  # not Linux: the line says what Python knows
    return (f"{datetime.date.today().isoformat()}, {model}, {len(os.sched_getaffinity(0))} cores, "
            f"{platform.system()} {platform.release()}")


def run_table(runs):
    lines = ["| renderer | options | threads | CPU [s] | wall [s] | MRE | median | bias |",
             "| --- | --- | --- | --- | --- | --- | --- | --- |"]
    lines += [f"| {r.renderer} | `{r.options}` | {r.threads} | {r.cost.cpu:.1f} | {r.cost.wall:.1f} | "
              f"{100 * r.mre:.1f} % | {100 * r.median:.1f} % | {100 * r.bias:+.1f} % |" for r in runs]
    return "\n".join(lines)


def points(runs, measure):
    return [(r.mre, getattr(r.cost, measure)) for r in runs]


def cell(at):
    return f"{at.cost:.1f}{MARKS[at.kind]}" if at else "not reached"


def ratio(peer, own):
    return f"{peer.cost / own.cost:.1f} x" if peer and own else ""


def equal_row(error, label, peer_costs, splat_runs):
    """`peer_costs` are CPU and wall CostAt; the splatted side is interpolated between its own runs."""
    own = [equal_error.cost_at(error, points(splat_runs, measure)) for measure in ("cpu", "wall")]
    return (f"| {100 * error:.1f} % | {label} | {cell(peer_costs[0])} | {cell(peer_costs[1])} | {cell(own[0])} | "
            f"{cell(own[1])} | {ratio(peer_costs[0], own[0])} | {ratio(peer_costs[1], own[1])} |")


def equal_table(splat_runs, cache_runs, path_runs, errors):
    """Caching renderers at the error of each of their runs, path tracers at each of `errors`."""
    lines = ["| indirect MRE | renderer | CPU [s] | wall [s] | rcsplat CPU [s] | rcsplat wall [s] | CPU | wall |",
             "| --- | --- | --- | --- | --- | --- | --- | --- |"]
    for r in cache_runs:
        costs = [equal_error.CostAt(r.cost.cpu, "measured"), equal_error.CostAt(r.cost.wall, "measured")]
        lines.append(equal_row(r.mre, f"{r.renderer} `{r.options}`", costs, splat_runs))
    for renderer in dict.fromkeys(r.renderer for r in path_runs):
        runs = [r for r in path_runs if r.renderer == renderer]
        for error in errors:
            costs = [equal_error.path_cost_at(error, points(runs, measure)) for measure in ("cpu", "wall")]
            lines.append(equal_row(error, renderer, costs, splat_runs))
    return "\n".join(lines)
