"""Options of a render. RCS_UPDATE_DOCS=1 build/release/bin/option_pages_test writes this from the library's table."""

from __future__ import annotations

from typing import Dict, Sequence, Tuple, TypedDict


class RenderOptions(TypedDict, total=False):
    """Those of docs/options.md, by the same names."""

    width: int
    """Width of the picture: a whole number in [1, 16384] [px]."""
    height: int
    """Height of the picture: a whole number in [1, 16384] [px]."""
    crop: Tuple[int, int, int, int]
    """Render this window of the picture alone, X,Y its upper left corner: X,Y,WIDTH,HEIGHT, whole numbers,
    within the picture [px]."""
    f_stop: float
    """Depth of field by a lens of that f-number before 24 mm of film: a value in (0, 1000000]."""
    focus: float
    """With --f-stop: depth of what is sharp: a value in (0, 1000000000] [m]."""
    target_error: float
    """Mean relative error to stop at, such as 5%, of the picture and of its indirect light: records and rays
    go where it takes them: a value in (0, 1]."""
    target_indirect_error: float
    """The same for indirect light alone, such as indirect=5%: a value in (0, 1]."""
    budget_seconds: float
    """Wall time to spend, such as 20s or 2m: records and rays go where they lower the error most: a value in
    (0, 1000000] [s]."""
    bounces: int
    """Bounces of indirect light; 8 is about all there is: a whole number in [0, 64]."""
    error_tolerance: float
    """Ward's a, the error that records may be off by; smaller is finer: a value in (0, 1]."""
    rays: int
    """Hemisphere rays for each record at first: a whole number in [16, 65536]."""
    noise_target: float
    """Standard error wanted at a pixel, relative to its light, on wide plain surfaces; where records lie
    closer it may be more. Noisy places take more rays: a value in (0, 1]."""
    refinement: int
    """So many times --rays a record takes at the most where --noise asks for more; 1 takes no more anywhere:
    a whole number in [1, 512]."""
    min_reach: float
    """Least harmonic mean distance of a record, at most --max-reach: --accuracy times it is the closest that
    records lie, a third of that where light is steep: a value in (0, 1000000000] [px]."""
    max_reach: float
    """Largest harmonic mean distance of a record: --accuracy times it is the widest that records lie apart: a
    value in (0, 1000000000] [px]."""
    gradient_limit: float
    """Harmonic mean distance of a record at the most, in times the way on which its light doubles: a value in
    (0, 1000000000]."""
    overlap: float
    """Reach of a record, in times the distance to the next one; more is smoother: a value in [1, 16]."""
    splat: str
    """How records reach the image; auto takes tiles on a software OpenGL, on a graphics card what a short
    measurement, kept in the user's cache folder, found fastest: one of auto, quads, tiles, gpu-tiles."""
    gather: str
    """What traces the rays of records; auto takes the graphics card where a short measurement, kept in the
    user's cache folder, found it faster, else the processor: one of auto, cpu, gpu."""
    device: int
    """Graphics device by its number, as rcsplat doctor lists them; -1 takes hardware before software: a whole
    number in [-1, 63]."""
    aa: int
    """Samples a pixel; 1 samples its centre: a whole number in [1, 256]."""
    area_samples: int
    """Shadow rays a pixel towards lamps with area; penumbras take more: a whole number in [1, 1024]."""
    penumbra_samples: int
    """The same in penumbras, where fewer than --area-samples count as those: a whole number in [1, 65536]."""
    lamp_picks: int
    """So many triangles of lamps, picked by what they would send, stand for all: quick and noisy; 0 leaves
    none out: a whole number in [0, 1024]."""
    lobe_rays: int
    """Rays a pixel along reflections too sharp for records; up to six times as many where noise would show: a
    whole number in [1, 1024]."""
    denoise: str
    """Filter direct light and sharp reflections by Open Image Denoise 2, which has to be installed (PyPI:
    pyoidn), where independent samples say that it helps: one of off, oidn."""
    with_effects: Sequence[str]
    """Simulate these effects in any case; may be given several times: names that rcsplat plan lists."""
    without_effects: Sequence[str]
    """Leave these effects out in any case: names that rcsplat plan lists."""
    seed: int
    """Seed of all random numbers: a whole number in [0, 18446744073709551615]."""


CHOICES: Dict[str, Tuple[str, ...]] = {
    "splat": ("auto", "quads", "tiles", "gpu-tiles"),
    "gather": ("auto", "cpu", "gpu"),
    "denoise": ("off", "oidn"),
}
