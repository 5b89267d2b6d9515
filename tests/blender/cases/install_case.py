"""The file that package.py makes, installed as a user does: by Blender's own operator. It renders, and is removed."""

import os

import bpy
import stage

ZIP = os.environ["RCS_ZIP"]
if bpy.app.version >= (4, 2):
    assert bpy.ops.extensions.package_install_files(
        filepath=ZIP, repo="user_default", enable_on_install=True) == {"FINISHED"}
    name = "bl_ext.user_default.rcsplat_render"
else:
    assert bpy.ops.preferences.addon_install(filepath=ZIP) == {"FINISHED"}
    name = "rcsplat_render"
    assert bpy.ops.preferences.addon_enable(module=name) == {"FINISHED"}
addon = bpy.context.preferences.addons.get(name)
assert addon is not None and addon.preferences.may_start, "the add-on is not there with its preferences"

scene = bpy.context.scene
scene.render.engine = "RCSPLAT"
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 48, 32, 100
scene.render.filepath = str(stage.OUT / "cube.png")
scene.render.image_settings.file_format = "PNG"
bpy.ops.render.render(write_still=True)
image = bpy.data.images.load(scene.render.filepath)
assert tuple(image.size) == (48, 32) and max(image.pixels[:3 * 4 * 48]) > 0.0

module = __import__(name, fromlist=["server"])
assert module.server.SERVER.started
bpy.ops.preferences.addon_disable(module=name)
assert not module.server.SERVER.started, "the server that was started outlived the add-on"
assert not hasattr(scene, "rcsplat")
print("case: all held", flush=True)
os._exit(0)
