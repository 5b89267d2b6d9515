"""Radiance cache splatting by hand, as in a notebook: each cell (# %%) may be run by itself.

usage: by_hand.py [FOLDER]     writes its pictures there; the default is the current folder
"""
# %% A scene, and a session that keeps threads, OpenGL and rays from cell to cell
import pathlib
import sys

import numpy as np

import rcs

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
session = rcs.Session()
session.show(rcs.load_scene("demo:cornell"))
print(session.scene.name, session.scene.cameras, session.scene.triangles, "triangles")

# %% A picture; its layers are arrays that look at the library's memory
result = rcs.render(session, width=160, height=160, aa=1)
indirect = result.picture["indirect"]
print("indirect light", indirect.shape, "mean", indirect.mean(), "from", len(result.records), "records")
rcs.write(str(folder / "cornell.png"), result.picture, session)

# %% Its halves: points that pixels see, records on a grid of them, splats
gbuffer = rcs.render_gbuffer(session, width=160, height=160)
rows, columns = np.mgrid[4:160:8, 4:160:8]
pixels = (rows * 160 + columns)[gbuffer.covered[rows, columns]]
records = rcs.gather_records(session, gbuffer, pixels, rays=256)
splats = rcs.splat(session, records, gbuffer, overlap=6.0)
irradiance = splats.irradiance()
print(len(records), "records on a grid reach", int((splats.count > 0).sum()), "of", splats.count.size, "pixels")
rcs.write(str(folder / "irradiance.exr"), irradiance)

# %% How wrong is it? The path tracer says
reference = rcs.render_reference(session, width=160, height=160, samples=64)
errors = rcs.compare(result.picture, reference, layer="indirect")
print(f"mean relative error {errors['mean_relative_error']:.1%} (noise of the reference included)")
