#!/usr/bin/env python3
"""Makes the pictures of docs/stages.md. usage: PYTHONPATH=build/release/lib/python docs/site/stages.py [FOLDER]"""
import pathlib
import sys

import numpy as np
from PIL import Image

import rcs

SIZE = 240
FOLDER = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parents[1] / "stages")


def save(name, values, white=1.0):
    """Linear values, `white` the brightest; sRGB, roughly."""
    shown = np.clip(np.asarray(values, np.float32) / white, 0.0, 1.0) ** (1.0 / 2.2)
    if shown.ndim == 2:
        shown = np.repeat(shown[..., None], 3, axis=2)
    Image.fromarray((255.0 * shown[..., :3] + 0.5).astype(np.uint8)).save(FOLDER / f"{name}.jpg", quality=88)


def weighted(splats):
    return np.stack([splats.weighted_r, splats.weighted_g, splats.weighted_b], axis=-1)


def main():
    FOLDER.mkdir(parents=True, exist_ok=True)
    session = rcs.Session()
    session.show(rcs.load_scene("demo:cornell"))
    result = rcs.render(session, width=SIZE, height=SIZE, aa=1)
    picture = result.picture
    light = 1.2 * np.quantile(picture["beauty"][..., :3], 0.97)
    save("albedo", picture["albedo"])
    save("normal", (0.5 * picture["normal"] + 0.5) ** 2.2)
    depth = picture["depth"]
    save("depth", 1.0 - (depth - depth.min()) / np.ptp(depth[np.isfinite(depth)]))
    for layer in ["direct", "indirect", "beauty"]:
        save(layer, picture[layer][..., :3], light)
    reference = rcs.render_reference(session, width=SIZE, height=SIZE, samples=256)
    save("reference", reference["beauty"][..., :3], light)

    gbuffer = rcs.render_gbuffer(session, width=SIZE, height=SIZE)
    eye = session.camera().world_from_view[:3, 3]
    points = np.stack([gbuffer.position_x, gbuffer.position_y, gbuffer.position_z], axis=-1) + eye
    records = rcs.place_records(session, gbuffer)
    nearest = np.full((SIZE, SIZE), np.inf, np.float32)
    dots = picture["indirect"][..., :3] * 0.5
    for position, radius in zip(records.position, records.spacing_radius):
        distance = np.linalg.norm(points - position, axis=-1)
        nearest = np.minimum(nearest, distance / radius)
        row, column = np.unravel_index(np.argmin(distance), distance.shape)
        dots[max(row - 1, 0):row + 1, max(column - 1, 0):column + 1] = (light, 0.75 * light, 0.1 * light)
    save("records", dots, light)
    save("spacing", nearest)

    splats = rcs.splat(session, records, gbuffer, overlap=3.0)
    bright = np.quantile(weighted(splats), 0.99)
    save("splat-all", weighted(splats), bright)
    save("weight", splats.weight, np.quantile(splats.weight, 0.99))
    save("irradiance", splats.irradiance(), np.quantile(splats.irradiance(), 0.99))
    pixels = np.random.default_rng(7).permutation(np.flatnonzero(gbuffer.covered))
    for count in [1, 10, 100]:
        few = rcs.gather_records(session, gbuffer, pixels[:count], rays=512)
        sums = weighted(rcs.splat(session, few, gbuffer, overlap=2.0))
        save(f"splat-{count}", sums, np.quantile(splats.irradiance(), 0.99))
    print(f"{len(records)} records, pictures in {FOLDER}")


main()
