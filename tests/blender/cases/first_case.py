"""Blender's own default scene: a picture with its passes, by a server that the add-on starts and ends; what goes wrong
is one line."""

import json

import bpy
import numpy
import stage

addon = stage.start()
bpy.ops.wm.read_homefile(use_factory_startup=True)
scene = bpy.context.scene
scene.render.engine = "RCSPLAT"
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 192, 128, 50
layer = scene.view_layers[0]
for name in ("z", "normal", "diffuse_direct", "diffuse_indirect", "diffuse_color", "emit", "cryptomatte_object"):
    setattr(layer, f"use_pass_{name}", True)
picture = stage.rendered(scene)
combined = stage.color(picture)
assert combined.shape == (64, 96, 3), combined.shape
sum_of = stage.color(picture, "DiffCol") * (
    stage.color(picture, "DiffDir") + stage.color(picture, "DiffInd")) + stage.color(picture, "Emit")
assert numpy.allclose(sum_of, combined, rtol=2e-3, atol=1e-4), "the passes' sum is another picture"
assert picture["Combined.A"].min() == 1.0
seen = picture["Depth.Z"] < 1e9
middle = picture["Depth.Z"][32, 48]
from_camera = scene.camera.matrix_world.inverted() @ scene.objects["Cube"].matrix_world.translation
assert -from_camera.z - 3.0**0.5 - 0.01 < middle < -from_camera.z, (middle, from_camera)
normals = numpy.stack([picture[f"Normal.{c}"] for c in "XYZ"], axis=-1)
assert {tuple(n) for n in numpy.round(normals[seen & (picture["Combined.A"] == 1.0)]) if abs(n).sum() == 1.0} == {
    (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)}, "the cube's three sides are +X, -Y and +Z of Blender"
assert addon.server.SERVER.started
before = addon.engine.REPORT.sent
assert before > 1000, before

# The same again uploads nothing; another material the document alone, not the mesh.
stage.rendered(scene)
assert addon.engine.REPORT.sent == 0, addon.engine.REPORT.sent
material = scene.objects["Cube"].data.materials[0]
material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.8, 0.1, 0.1, 1.0)
red = stage.color(stage.rendered(scene))
folder = addon.snapshot.FOLDER.path()
sizes = sorted(path.stat().st_size for path in folder.glob("scene-*.gltf"))
print(f"case: uploaded {before} bytes, then 0, then {addon.engine.REPORT.sent} of a changed material", flush=True)
print(f"case: the second render began {1e3 * addon.engine.REPORT.waited:.0f} ms after its export", flush=True)
assert addon.engine.REPORT.sent in sizes, (addon.engine.REPORT.sent, sizes)
assert len(list(folder.glob("mesh-*.bin"))) == 1
assert red[32, 48, 0] > 3.0 * red[32, 48, 1]

# A window of the picture has its pixels.
scene.render.use_border, scene.render.use_crop_to_border = True, True
scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.75
scene.render.border_min_y, scene.render.border_max_y = 0.25, 0.5
part = stage.rendered(scene)
assert part["Combined.R"].shape == (16, 48), part["Combined.R"].shape
apart = numpy.abs(stage.color(part)[..., 0] - red[32:48, 24:72, 0]).mean() / red[..., 0].mean()
assert apart < 0.03, apart
scene.render.use_border = False

# What it will take is said before, by a job that ends without a picture.
assert bpy.ops.rcsplat.forecast() == {"FINISHED"}
print(f"case: forecast: {addon.engine.REPORT.forecast}", flush=True)
assert addon.engine.REPORT.forecast.startswith("5 % ") and addon.engine.REPORT.forecast.endswith(" s")
effects = addon.engine.REPORT.last["plan"]["effects"]
assert effects and all(effect["reason"] for effect in effects), effects
scene.rcsplat.goal = "BUDGET"
assert not bpy.ops.rcsplat.forecast.poll(), "the time is given"
scene.rcsplat.goal = "ERROR"

# Previews of materials are made from what the dependency graph has: there is no exporter for Blender's scene of them.
taken = addon.preview.take(bpy.context.evaluated_depsgraph_get(), addon.snapshot.FOLDER.path())
document = json.loads(taken.scene.read_text())
assert [entry["name"] for entry in document["materials"]] == ["Material"], document["materials"]
assert numpy.allclose(document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"], (0.8, 0.1, 0.1, 1.0))
framing = addon.jobs.framing_of(scene.render)
seen = addon.cameras.seen_through(scene.camera, scene.render, framing.size)
small = addon.link.LINK.render(addon.settings.place(), taken.scene,
                               addon.preview.request(framing, seen, taken)).wait(120.0)
assert small.data and not small.failure and not small.warnings, (small.failure, small.warnings)
preview = stage.channels_of(addon.pictures.plain(small.data))
assert preview["R"][32, 48] > 3.0 * preview["G"][32, 48], "the material is red"
assert abs(preview["R"][32, 48] / red[32, 48, 0] - 1.0) < 0.1, (preview["R"][32, 48], red[32, 48, 0])

# One line for what cannot be rendered, and Blender goes on.
held, scene.camera = scene.camera, None
try:
    bpy.ops.render.render()
    said = ""
except RuntimeError as error:
    said = str(error)
assert "camera" in said and said.strip().count("\n") == 0, said
scene.camera = held
stage.rendered(scene)
stage.end(addon)
