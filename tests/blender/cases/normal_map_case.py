"""A normal map that Blender bakes from a fine mesh onto a coarse one looks as in Cycles: with the file's tangents, and
with those that the server makes where a file has none."""

import math
import os

import bpy  # before bmesh, which is a part of it
import bmesh
import numpy
import stage
from mathutils import Vector, noise

addon = stage.start()
SAMPLES = int(os.environ.get("RCS_CYCLES_SAMPLES", "256"))
SIZE = 256  # of the map


def coarse(scene):
    """A ball of few faces with smooth normals, whose halves share the map, one in a mirror."""
    work = bmesh.new()
    bmesh.ops.create_uvsphere(work, u_segments=10, v_segments=6, radius=1.0)
    bmesh.ops.triangulate(work, faces=work.faces[:])
    layer = work.loops.layers.uv.new("map")
    for face in work.faces:
        face.smooth = True
        for loop in face.loops:
            place = loop.vert.co
            about = place if math.hypot(place.x, place.y) > 1e-3 else face.calc_center_median()
            angle = math.atan2(abs(about.y), about.x) / math.pi
            loop[layer].uv = (0.04 + 0.92 * angle, 0.5 + 0.94 * math.asin(max(-1.0, min(1.0, place.z))) / math.pi)
    return finished(scene, "coarse", work)


def fine(scene):
    """The same with dents, alike on both halves."""
    work = bmesh.new()
    bmesh.ops.create_uvsphere(work, u_segments=120, v_segments=60, radius=1.0)
    for vertex in work.verts:
        x, y, z = vertex.co
        vertex.co *= 1.0 + 0.1 * noise.noise(2.5 * Vector((x, abs(y), z)) + Vector((0.2, 0.5, 0.8)))
    for face in work.faces:
        face.smooth = True
    return finished(scene, "fine", work)


def finished(scene, name, work):
    mesh = bpy.data.meshes.new(name)
    work.to_mesh(mesh)
    work.free()
    return stage.link(scene, name, mesh)


def baked_material(image):
    """White, with the map."""
    material = bpy.data.materials.new("baked")
    material.use_nodes = True
    tree = material.node_tree
    shader = tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (0.8, 0.8, 0.8, 1.0)
    shader.inputs["Roughness"].default_value = 0.5  # where Blender 3's diffuse light is least unlike Lambert's
    for socket in ("Specular", "Specular IOR Level"):
        if socket in shader.inputs:
            shader.inputs[socket].default_value = 0.0
    texture, turned = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
    texture.image = image
    turned.uv_map = "map"
    tree.links.new(texture.outputs["Color"], turned.inputs["Color"])
    tree.links.new(turned.outputs["Normal"], shader.inputs["Normal"])
    tree.nodes.active = texture
    return material


def bake(scene, source, target):
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 16
    for thing in scene.objects:
        thing.select_set(thing in (source, target))
    bpy.context.view_layer.objects.active = target
    assert bpy.ops.object.bake(type="NORMAL", normal_space="TANGENT", use_selected_to_active=True, cage_extrusion=0.5,
                               margin=4) == {"FINISHED"}
    scene.render.engine = "RCSPLAT"


scene = stage.empty((64, 64), aa=16)
scene.rcsplat.target_error = 2.0
where = (3.6, 0.6, 1.4)
stage.camera(scene, where, stage.aim(where, (0, 0, 0)), lens=50.0)
if stage.cycles(scene, 1, 0) is None:
    print("case: this Blender has no Cycles", flush=True)
    stage.end(addon)
image = bpy.data.images.new("map", SIZE, SIZE)
image.colorspace_settings.name = "Non-Color"
ball = coarse(scene)
ball.data.materials.append(baked_material(image))
dented = fine(scene)
bake(scene, dented, ball)
image.pack()
dented.hide_render = True
stage.lamp(scene, "SUN", (0, 0, 3), stage.aim((3.0, -1.5, 2.0), (0, 0, 0)), energy=3.0, angle=0.0)
theirs = stage.color(stage.cycles(scene, SAMPLES, 0))
# Beside the ball's rim, where each bends normals that look away from the viewer or the lamp in a way of its own.
y, x = numpy.mgrid[:64, :64] - 31.5
middle = numpy.hypot(x, y) < 16.0
relief = theirs[middle].std() / theirs[middle].mean()
assert relief > 0.15, relief
for tangents in (False, True):
    addon.snapshot.EXPORT["export_tangents"] = tangents
    ours = stage.color(stage.rendered(scene))
    newest = max(addon.snapshot.FOLDER.path().glob("scene-*.gltf"), key=lambda path: path.stat().st_mtime)
    text = newest.read_text()
    assert ('"TANGENT"' in text) == tangents and '"normalTexture"' in text
    if os.environ.get("RCS_KEEP"):
        numpy.savez(os.environ["RCS_KEEP"] + f"normal_map_{tangents}", ours=ours, theirs=theirs)
    error = numpy.sqrt(numpy.mean((ours - theirs)[middle] ** 2)) / theirs[middle].mean()
    said = "the file's tangents" if tangents else "tangents of the server"
    print(f"case: {said}: {100.0 * error:.2f} % root mean square error, of a relief of {100.0 * relief:.1f} %",
          flush=True)
    assert error < (0.03 if bpy.app.version < (4, 0) else 0.01), error
stage.end(addon)
