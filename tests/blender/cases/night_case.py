"""24 frames with an armature, a shape key and a lamp that moves: queued, rendered, fetched; frame 12 is a still of
frame 12. A job is cancelled; a server that dies is one line."""

import threading
import time

import bpy  # before addon_utils, which is a part of it
import addon_utils
import numpy
import stage

addon = stage.start()
scene = stage.empty((32, 24), aa=1)
scene.rcsplat.target_error = 20.0
scene.rcsplat.soft_lamps = False
scene.render.dither_intensity = 0.0
scene.frame_start, scene.frame_end = 1, 24
stage.plane(scene, "floor", 8.0, stage.diffuse("grey", (0.5, 0.5, 0.5)))
tower = stage.box(scene, "tower", (0.5, 0.5, 2.0), stage.diffuse("red", (0.6, 0.1, 0.1)), location=(0, 0, 1))
bones = bpy.data.armatures.new("bones")
rig = stage.link(scene, "rig", bones)
bpy.context.view_layer.objects.active = rig
bpy.ops.object.mode_set(mode="EDIT")
bone = bones.edit_bones.new("bone")
bone.head, bone.tail = (0, 0, 0), (0, 0, 2)
bpy.ops.object.mode_set(mode="OBJECT")
tower.vertex_groups.new(name="bone").add([1, 3, 5, 7], 1.0, "REPLACE")
modifier = tower.modifiers.new("bones", "ARMATURE")
modifier.object = rig
tower.shape_key_add(name="rest")
key = tower.shape_key_add(name="wide")
for point in key.data:
    point.co.x *= 2.0
lamp = stage.lamp(scene, "POINT", (2, -2, 3), energy=300.0, shadow_soft_size=0.0)
pose = rig.pose.bones["bone"]
pose.rotation_mode = "XYZ"
for frame, turn, width, x in ((1, 0.0, 0.0, 2.0), (24, 0.6, 1.0, -2.0)):
    pose.rotation_euler.z = turn
    pose.keyframe_insert("rotation_euler", frame=frame)
    key.value = width
    key.keyframe_insert("value", frame=frame)
    lamp.location.x = x
    lamp.keyframe_insert("location", frame=frame)
where = (0.0, -6.0, 3.0)
stage.camera(scene, where, stage.aim(where, (0, 0, 1)))

folder = stage.OUT / "frames"
if hasattr(scene.render.image_settings, "media_type"):
    scene.render.image_settings.media_type = "IMAGE"
scene.render.image_settings.file_format = "PNG"
scene.render.filepath = str(folder / "night_####")
began = time.perf_counter()
assert bpy.ops.rcsplat.queue() == {"FINISHED"}
print(f"case: 24 frames were exported and queued in {time.perf_counter() - began:.1f} s", flush=True)
assert len(addon.night.nights()) == 1

# Blender is closed, and its server with it; another one goes on.
assert addon.server.SERVER.started
addon_utils.disable("rcsplat_render")
assert not addon.server.SERVER.started
addon = stage.start()
scene = bpy.context.scene
assert len(addon.night.nights()) == 1, "what was queued is forgotten"
until = time.monotonic() + 200.0
while addon.night.nights() and time.monotonic() < until:
    assert bpy.ops.rcsplat.fetch() == {"FINISHED"}
    time.sleep(0.5)
made = sorted(path.name for path in folder.iterdir())
assert made == [f"night_{n:04}.png" for n in range(1, 25)], made


def pixels(path):
    image = bpy.data.images.load(str(path))
    values = numpy.empty(image.size[0] * image.size[1] * image.channels, dtype=numpy.float32)
    image.pixels.foreach_get(values)
    channels = image.channels
    bpy.data.images.remove(image)
    return values.reshape(-1, channels)[:, :3]


scene.frame_set(12)
still = stage.OUT / "still.png"
scene.render.filepath = str(still)
bpy.ops.render.render(write_still=True)
twelve = pixels(folder / "night_0012.png")
apart = numpy.abs(pixels(still) - twelve).max()
print(f"case: frame 12 and a still of it differ by {apart:.4f} at the most", flush=True)
assert apart <= 1.01 / 255.0, apart
assert numpy.abs(pixels(folder / "night_0001.png") - twelve).max() > 0.1, "nothing moves"

# What the main thread does when Esc is pressed, here from beside: the job ends.
link = addon.link.LINK
scene.render.resolution_x, scene.render.resolution_y, scene.rcsplat.aa = 2000, 2000, 64
snapshot = addon.engine.snapshot_now(scene, False)
rendering = link.render(addon.settings.place(), snapshot.scene, {"width": 2000, "height": 2000, "aa": 64,
                                                                 "outputs": [addon.night.jobs.output(["emission"])]})
while not rendering.ticket.job:
    time.sleep(0.05)
time.sleep(0.5)
began = time.perf_counter()
rendering.cancel()


async def state_of(number):
    client = await link.client(addon.settings.place())
    return (await client.job(number).details()).status.state


while link.run(state_of(rendering.ticket.job)).result(5.0) not in addon.night.ENDED:
    time.sleep(0.02)
print(f"case: cancelled within {time.perf_counter() - began:.2f} s", flush=True)  # on a busy machine it may be more

# A server that dies in the middle.
process = addon.server.SERVER._process
threading.Timer(2.0, process.kill).start()
began = time.perf_counter()
try:
    bpy.ops.render.render()
    said = ""
except RuntimeError as error:
    said = str(error).strip()
print(f"case: {said!r} after {time.perf_counter() - began:.1f} s", flush=True)
assert said and "\n" not in said and time.perf_counter() - began < 120.0, said
scene.render.resolution_x, scene.render.resolution_y, scene.rcsplat.aa = 32, 24, 1
bpy.ops.render.render(write_still=True)  # by a new one
stage.end(addon)
