"""Irradiance under each lamp is what its watts say: radiant intensity P / 4 pi, radiance P / (pi A), W/m^2 of suns.

Before Blender 4.0 radiance is P / 4A, and spots shine with the cosine to their axis.
"""

import math

import bpy
import numpy
import stage

addon = stage.start()
TURN = 0.4  # of the sun, from the vertical
OLD = bpy.app.version < (4, 0)
FLAT = 0.25 * math.pi if OLD else 1.0


def irradiance(kind, where=(1.0, 0.0, 2.0), rotation=stage.DOWN, soft=False, **values):
    """On a white plane about the origin [W/m^2]."""
    scene = stage.empty((8, 8), aa=1)
    stage.plane(scene, "floor", 20.0, stage.diffuse("white", (1.0, 1.0, 1.0)))
    stage.camera(scene, (0.0, 0.0, 1.0), stage.DOWN, type="ORTHO", ortho_scale=1e-3)
    stage.lamp(scene, kind, where, rotation, **values)
    scene.rcsplat.soft_lamps = soft
    return stage.FLAT * float(numpy.mean(stage.color(stage.rendered(scene))))


def from_rectangle(width, height, distance):
    """Form factor of a parallel rectangle whose corner is above the point (Howell, B-4)."""
    a, b = width / distance, height / distance
    x, y = a / math.sqrt(1 + a * a), b / math.sqrt(1 + b * b)
    return (x * math.atan(b / math.sqrt(1 + a * a)) + y * math.atan(a / math.sqrt(1 + b * b))) / (2 * math.pi)


point = 100.0 / (4.0 * math.pi) * (2.0 / math.sqrt(5.0)) / 5.0
stage.close("point", irradiance("POINT", energy=100.0, shadow_soft_size=0.0), point, 0.005)
stage.close("point, radius 0.1", irradiance("POINT", energy=100.0, shadow_soft_size=0.1, soft=True), point, 0.005)
stage.close("red of a coloured one", 3.0 * irradiance("POINT", energy=100.0, shadow_soft_size=0.0,
                                                      color=(0.5, 0.25, 0.25)), point, 0.005)
for size, blend in ((100.0, 0.0), (100.0, 0.5), (70.0, 1.0), (60.0, 0.8)):
    edge = math.cos(math.radians(0.5 * size))
    t = min(1.0, max(0.0, (2.0 / math.sqrt(5.0) - edge) / max(1e-9, (1.0 - edge) * blend)))
    expected = point * (3.0 * t * t - 2.0 * t**3) * (2.0 / math.sqrt(5.0) if OLD else 1.0)
    if expected > 0.2 * point:
        found = irradiance("SPOT", energy=100.0, shadow_soft_size=0.0, spot_size=math.radians(size), spot_blend=blend)
        stage.close(f"spot of {size:g} degrees, blend {blend:g}", found, expected, 0.005)
    else:
        found = irradiance("SPOT", energy=100.0, shadow_soft_size=0.0, spot_size=math.radians(size), spot_blend=blend)
        print(f"case: spot of {size:g} degrees, blend {blend:g}: {found:.5f}, expected {expected:.5f}", flush=True)
        assert abs(found - expected) < 0.004 * point
stage.close("sun", irradiance("SUN", rotation=(TURN, 0.0, 0.0), energy=3.0, angle=0.0), 3.0 * math.cos(TURN), 0.005)
width, height = 0.6, 0.4
above = 4.0 * from_rectangle(0.5 * width, 0.5 * height, 2.0)
found = irradiance("AREA", (0.0, 0.0, 2.0), energy=100.0, shape="RECTANGLE", size=width, size_y=height)
stage.close("rectangle", found, FLAT * 100.0 / (width * height) * above, 0.005)
stage.close("square", irradiance("AREA", (0.0, 0.0, 2.0), energy=50.0, shape="SQUARE", size=1.0),
            FLAT * 50.0 * 4.0 * from_rectangle(0.5, 0.5, 2.0), 0.005)
disk = 0.5**2 / (0.5**2 + 2.0**2)
stage.close("disk", irradiance("AREA", (0.0, 0.0, 2.0), energy=50.0, shape="DISK", size=1.0),
            FLAT * 50.0 / (math.pi * 0.25) * disk, 0.005)
half, side = 0.4, 0.2
factor = half * side / math.sqrt((half**2 + 2.0**2) * (side**2 + 2.0**2))
stage.close("ellipse", irradiance("AREA", (0.0, 0.0, 2.0), energy=50.0, shape="ELLIPSE", size=2.0 * half,
                                  size_y=2.0 * side), FLAT * 50.0 / (math.pi * half * side) * factor, 0.005)
stage.end(addon)
