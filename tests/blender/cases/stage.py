"""What the cases share: the add-on in Blender, scenes, and pictures as arrays."""

import math
import os
import pathlib
import sys
import time

import bpy
import numpy

OUT = pathlib.Path(os.environ["RCS_OUT"])
sys.path.insert(0, os.environ["RCS_ADDON"])


def start():
    """The add-on, enabled as Blender does it."""
    import addon_utils

    module = addon_utils.enable("rcsplat_render", default_set=True)
    assert module is not None, "the add-on cannot be enabled"
    return module


def end(module):
    import addon_utils

    addon_utils.disable("rcsplat_render")
    assert not module.server.SERVER.started, "the server that was started outlived the add-on"
    print("case: all held", flush=True)
    sys.stdout.flush()
    os._exit(0)  # bpy as a module takes long to end


def empty(size=(32, 32), aa=4):
    """A scene with nothing in it, no light, and Lambert's plain settings in both engines."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.engine = "RCSPLAT"
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    world(scene, (0.0, 0.0, 0.0))
    scene.rcsplat.aa = aa
    scene.rcsplat.target_error = 1.0
    scene.rcsplat.bounces = 0
    return scene


def world(scene, color, strength=1.0):
    node = next(n for n in scene.world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    node.inputs["Color"].default_value = (*color, 1.0)
    node.inputs["Strength"].default_value = strength
    return node


def link(scene, name, data, location=(0.0, 0.0, 0.0), rotation=(0.0, 0.0, 0.0)):
    thing = bpy.data.objects.new(name, data)
    thing.location, thing.rotation_euler = location, rotation
    scene.collection.objects.link(thing)
    return thing


def shader(name, kind, **values):
    """A material of one shader with values by its sockets' names."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    node, output = tree.nodes.new(kind), tree.nodes.new("ShaderNodeOutputMaterial")
    for socket, value in values.items():
        node.inputs[socket.replace("_", " ")].default_value = value
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def diffuse(name, color):
    return shader(name, "ShaderNodeBsdfDiffuse", Color=(*color, 1.0))


def mesh(scene, name, points, faces, material=None, **place):
    data = bpy.data.meshes.new(name)
    data.from_pydata(points, [], faces)
    if material is not None:
        data.materials.append(material)
    return link(scene, name, data, **place)


def plane(scene, name, size, material, **place):
    h = 0.5 * size
    return mesh(scene, name, [(-h, -h, 0), (h, -h, 0), (h, h, 0), (-h, h, 0)], [(0, 1, 2, 3)], material, **place)


def box(scene, name, size, material, **place):
    x, y, z = (0.5 * s for s in size)
    points = [(i, j, k) for i in (-x, x) for j in (-y, y) for k in (-z, z)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return mesh(scene, name, points, faces, material, **place)


def lamp(scene, kind, location, rotation=(0.0, 0.0, 0.0), **values):
    data = bpy.data.lights.new(kind, kind)
    for name, value in values.items():
        setattr(data, name, value)
    return link(scene, kind, data, location, rotation)


def camera(scene, location, rotation, **values):
    data = bpy.data.cameras.new("camera")
    for name, value in values.items():
        setattr(data, name, value)
    scene.camera = link(scene, "camera", data, location, rotation)
    return scene.camera


def aim(location, target):
    """Turn of a camera or lamp there that looks at the target."""
    from mathutils import Vector

    return (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()


def rendered(scene):
    """Channels by name, rows from the top, of a render in the scene's engine."""
    path = OUT / "picture.exr"
    path.unlink(missing_ok=True)
    if hasattr(scene.render.image_settings, "media_type"):  # Blender 5
        scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
        scene.render.image_settings.use_exr_interleave = True  # one part
    scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.exr_codec = "ZIP"
    scene.render.filepath = str(path)
    began = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    rendered.seconds = time.perf_counter() - began
    return channels_of(path.read_bytes())


def channels_of(data):
    """Each by itself, by Blender's own reader."""
    from rcsplat_render import exr_file

    header, found = exr_file.read_header(data), {}
    for name in exr_file.channel_names(header):
        one = OUT / "one.exr"
        one.write_bytes(exr_file.renamed(data, {name: "Y"}))
        image = bpy.data.images.load(str(one))
        width, height = image.size
        values = numpy.empty(width * height * image.channels, dtype=numpy.float32)
        image.pixels.foreach_get(values)
        bpy.data.images.remove(image)
        found[name.split(".", 1)[-1]] = values.reshape(height, width, -1)[::-1, :, 0].astype(numpy.float64)
    return found


def color(picture, name="Combined"):
    return numpy.stack([picture[f"{name}.{c}"] for c in "RGB"], axis=-1)


def cycles(scene, samples, bounces, seed=0):
    """The same scene by Blender's path tracer; none where this Blender lacks it."""
    if not hasattr(bpy.types.Scene, "cycles"):
        import addon_utils

        if addon_utils.enable("cycles") is None:
            return None
    scene.render.engine = "CYCLES"
    own = scene.cycles
    own.device, own.samples, own.use_denoising, own.use_adaptive_sampling = "CPU", samples, False, False
    own.seed = seed
    own.pixel_filter_type, own.filter_width = "BOX", 1.0
    own.sample_clamp_indirect = own.sample_clamp_direct = 0.0
    own.max_bounces, own.diffuse_bounces, own.glossy_bounces = bounces, bounces, bounces
    own.caustics_reflective = own.caustics_refractive = True
    own.blur_glossy = 0.0
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    picture = rendered(scene)
    scene.render.engine = "RCSPLAT"
    return picture


def close(what, found, expected, tolerance):
    wrong = abs(found - expected) / abs(expected)
    print(f"case: {what}: {found:.6g}, expected {expected:.6g}, {100.0 * wrong:.3f} % off", flush=True)
    assert wrong <= tolerance, f"{what}: {100.0 * wrong:.3f} % off, expected within {100.0 * tolerance:g} %"


DOWN = (0.0, 0.0, 0.0)
FLAT = math.pi  # of a white Lambertian surface: irradiance over radiance
