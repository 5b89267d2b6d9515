"""Small scenes against Blender's path tracer: the means of their pictures within 2 %.

$RCS_CYCLES_SAMPLES: how many, in place of 256; $RCS_SCENE: those alone that have this in their names.
"""

import math
import os

import bpy
import numpy
import stage

addon = stage.start()
SAMPLES = int(os.environ.get("RCS_CYCLES_SAMPLES", "256"))
FINER = 3
EDGE = 0.15  # of a pixel's mean, that its parts scatter by
WHITE, RED, GREEN = (0.75, 0.75, 0.75), (0.6, 0.06, 0.05), (0.1, 0.45, 0.09)


def room(scene):
    """Cornell's, open towards -Y."""
    white, red, green = (stage.diffuse(n, c) for n, c in (("white", WHITE), ("red", RED), ("green", GREEN)))
    quarter = 0.5 * math.pi
    stage.plane(scene, "floor", 2.0, white)
    stage.plane(scene, "ceiling", 2.0, white, location=(0, 0, 2), rotation=(math.pi, 0, 0))
    stage.plane(scene, "back", 2.0, white, location=(0, 1, 1), rotation=(quarter, 0, 0))
    stage.plane(scene, "left", 2.0, red, location=(-1, 0, 1), rotation=(0, quarter, 0))
    stage.plane(scene, "right", 2.0, green, location=(1, 0, 1), rotation=(0, -quarter, 0))
    first = stage.box(scene, "small", (0.55, 0.55, 0.55), white, location=(0.35, -0.3, 0.275), rotation=(0, 0, 0.3))
    second = stage.link(scene, "tall", first.data, (-0.35, 0.3, 0.5), (0, 0, -0.3))  # an instance
    second.scale = (1.0, 1.0, 1.8)
    stage.camera(scene, (0, -3.6, 1), (quarter, 0, 0), lens=36.0)


def square_error(picture, truth):
    """Mean squared relative error, dark pixels held back."""
    return float(numpy.mean((picture - truth) ** 2 / (truth**2 + 1e-2 * truth.mean() ** 2)))


def finer(scene):
    """With FINER times the pixels a side, averaged: records lie no closer than pixels, in these very small pictures.

    @return the picture, and the pixels that no edge passes: there, coverage by few samples is all of the difference
    """
    scene.render.resolution_percentage = 100 * FINER
    picture = stage.color(stage.rendered(scene))
    scene.render.resolution_percentage = 100
    height, width = picture.shape[0] // FINER, picture.shape[1] // FINER
    parts = picture.reshape(height, FINER, width, FINER, 3)
    mean = parts.mean(axis=(1, 3))
    return mean, (parts.std(axis=(1, 3)) <= EDGE * mean).all(axis=-1)


def check(name, scene, bounces=2, tolerance=0.02):
    """The mean, and that pixels differ by no more than what both say of their own noise."""
    if os.environ.get("RCS_SCENE", "") not in name:
        return
    scene.rcsplat.bounces = bounces
    ours, inside = finer(scene)
    halves = [stage.cycles(scene, SAMPLES // 2, bounces, seed) for seed in (1, 2)]
    if halves[0] is None:
        return
    first, second = (stage.color(half) for half in halves)
    theirs = 0.5 * (first + second)
    if os.environ.get("RCS_KEEP"):
        numpy.savez(os.environ["RCS_KEEP"] + name.replace(" ", "_"), ours=ours, theirs=theirs)
    noise = square_error(0.5 * (first - second)[inside] + theirs[inside], theirs[inside])
    stated = addon.engine.REPORT.last["error_estimate"]["image"]
    error = square_error(ours[inside], theirs[inside])
    print(f"case: {name}: relMSE {square_error(ours, theirs):.1e}, without edges ({inside.mean():.0%}) {error:.1e}, "
          f"Cycles' noise {noise:.1e}, stated mean error {stated['mean_relative']:.1e}, at the 95th percentile "
          f"{stated['p95_relative']:.1e}", flush=True)
    assert error <= 2.0 * noise + stated["p95_relative"] ** 2, "more than both say of themselves"
    stage.close(name, ours.mean(), theirs.mean(), tolerance)


def cornell(kind, where=(0, 0, 1.9), rotation=stage.DOWN, **values):
    scene = stage.empty((32, 32), aa=4)
    scene.rcsplat.target_error = 2.0
    room(scene)
    scene.rcsplat.soft_lamps = False
    stage.lamp(scene, kind, where, rotation, **values)
    return scene


# Beyond the picture: here lamps with area are seen.
ABOVE = ((0, -1.8, 2.3), stage.aim((0, -1.8, 2.3), (0, 0.4, 0.5)))
check("area lamp", cornell("AREA", *ABOVE, energy=80.0, shape="SQUARE", size=0.5))
check("point lamp", cornell("POINT", (0, -0.4, 1.6), energy=40.0, shadow_soft_size=0.0))
check("spot", cornell("SPOT", (0, -0.5, 1.9), energy=200.0, spot_size=1.2, spot_blend=0.4, shadow_soft_size=0.0))
check("sun", cornell("SUN", (0, -3, 3), stage.aim((0, -3, 3), (0.2, 0, 0.8)), energy=4.0, angle=0.0))

scene = cornell("AREA", *ABOVE, energy=80.0, shape="DISK", size=0.6)
scene.camera.data.shift_x, scene.camera.data.shift_y, scene.camera.data.lens = 0.15, -0.2, 50.0
check("shifted camera", scene)
scene.render.resolution_x = 48
check("shifted, wide", scene)
scene.render.resolution_x, scene.render.resolution_y = 24, 36
check("shifted, high", scene)
scene.camera.data.sensor_fit, scene.camera.data.sensor_height = "VERTICAL", 30.0
check("shifted, sensor fit vertical", scene)
scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 2.2
check("shifted, parallel", scene)


def open_scene():
    """A box on a floor beneath a sky."""
    found = stage.empty((36, 27), aa=4)
    found.rcsplat.target_error = 2.0
    stage.plane(found, "floor", 12.0, stage.diffuse("grey", (0.5, 0.5, 0.5)))
    stage.box(found, "box", (1, 1, 1), stage.diffuse("red", RED), location=(0, 0, 0.5), rotation=(0, 0, 0.4))
    where = (3.0, -4.0, 2.5)
    stage.camera(found, where, stage.aim(where, (0, 0, 0.4)), lens=35.0)
    return found


scene = open_scene()
stage.world(scene, (0.3, 0.4, 0.6), 1.5)
check("plain world", scene)

x, y = numpy.meshgrid(numpy.arange(64), numpy.arange(32))
glow = numpy.exp(-0.5 * (((x - 50) / 5.0) ** 2 + ((y - 22) / 3.0) ** 2))
pixels = numpy.stack([0.2 + 6.0 * glow, 0.3 + 4.0 * glow, 0.5 + 2.0 * glow, numpy.ones_like(glow)], axis=-1)
for turn in (0.0, 1.1):
    scene = open_scene()
    tree = scene.world.node_tree
    texture, mapping, coordinates = (tree.nodes.new(kind) for kind in (
        "ShaderNodeTexEnvironment", "ShaderNodeMapping", "ShaderNodeTexCoord"))
    image = bpy.data.images.new("sky", 64, 32, float_buffer=True)
    image.pixels.foreach_set(pixels.astype(numpy.float32).reshape(-1))
    texture.image = image
    mapping.inputs["Rotation"].default_value[2] = turn
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], stage.world(scene, (0, 0, 0), 0.8).inputs["Color"])
    check(f"image world turned by {turn:g}", scene)

# A picture on a floor, seen at an angle.
scene = open_scene()
stage.world(scene, (0.5, 0.5, 0.5))
colors = numpy.random.default_rng(4).uniform(0.1, 0.9, (16, 16, 4)).astype(numpy.float32)
colors[..., 3] = 1.0
image = bpy.data.images.new("tiles", 256, 256)
image.pixels.foreach_set(numpy.kron(colors, numpy.ones((16, 16, 1), dtype=numpy.float32)).reshape(-1))
image.pack()
tiles = bpy.data.materials.new("tiles")
tiles.use_nodes = True
principled = tiles.node_tree.nodes["Principled BSDF"]
for socket in ("Specular", "Specular IOR Level"):
    if socket in principled.inputs:
        principled.inputs[socket].default_value = 0.0
texture = tiles.node_tree.nodes.new("ShaderNodeTexImage")
texture.image = image
tiles.node_tree.links.new(texture.outputs["Color"], principled.inputs["Base Color"])
floor = scene.objects["floor"].data
floor.materials[0] = tiles
corners = floor.uv_layers.new(name="map").data
for corner, place in zip(corners, ((0, 0), (3, 0), (3, 3), (0, 3))):
    corner.uv = place
stage.lamp(scene, "SUN", (0, 0, 3), stage.aim((2, -2, 3), (0, 0, 0)), energy=2.0, angle=0.0)
check("texture", scene)

# A plain principled shader, and light of a surface that shines.
scene = cornell("AREA", *ABOVE, energy=40.0, shape="SQUARE", size=0.5)
plain = bpy.data.materials.new("plain")
plain.use_nodes = True
principled = plain.node_tree.nodes["Principled BSDF"]
principled.inputs["Base Color"].default_value = (0.2, 0.3, 0.7, 1.0)
principled.inputs["Roughness"].default_value = 0.7
scene.objects["small"].data.materials[0] = plain
shining = stage.shader("shining", "ShaderNodeEmission", Color=(1.0, 0.7, 0.4, 1.0), Strength=6.0)
stage.plane(scene, "panel", 0.5, shining, location=(0.4, 0.98, 1.4), rotation=(0.5 * math.pi, 0, 0))
check("principled boxes, a shining panel", scene)
stage.end(addon)
