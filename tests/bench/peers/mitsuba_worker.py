"""One timed process of Mitsuba's path tracer: `mitsuba_worker.py FILE.glb CAMERA WIDTH HEIGHT SPP DEPTH FOLDER OUT.bin`
writes the mean radiance of paths of up to DEPTH segments through pixel centres, as floats, rows from the top."""

import sys

import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")  # before the modules that derive from its classes
import drjit as dr
import gltf
import mitsuba_scene

PATHS_AT_ONCE = 1 << 22  # bounds memory


def centre_rays(camera, width, height):
    """Origins and directions (width * height, 3), rows from the top."""
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2)
    tangent = np.tan(camera.yfov / 2)
    directions = (camera.forward + (x * tangent * width / height)[..., None] * camera.right
                  + (y * tangent)[..., None] * camera.up).reshape(-1, 3)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.broadcast_to(camera.eye, directions.shape), directions


def trace(scene, rays, pixels, spp, depth):
    """Mean over `spp` paths, (pixels, 3). Paths of another depth share their random numbers up to there."""
    integrator = mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": 1000})
    total = np.zeros((pixels, 3))
    at_once = max(1, min(spp, PATHS_AT_ONCE // pixels))
    origins, directions = (np.ascontiguousarray(values.T, np.float32) for values in rays)
    for first in range(0, spp, at_once):
        count = min(at_once, spp - first)
        index = dr.arange(mi.UInt32, pixels * count) // count
        ray = mi.RayDifferential3f(o=dr.gather(mi.Point3f, mi.Point3f(origins), index),
                                   d=dr.gather(mi.Vector3f, mi.Vector3f(directions), index))
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(first + 1, pixels * count)
        radiance, _, _ = integrator.sample(scene, sampler, ray)
        mean = dr.block_sum(dr.ravel(radiance, order="C"), count)
        total += np.array(mean).reshape(3, pixels).T
    return total / spp


def main():
    path, camera_name, width, height, spp, depth, folder, out = sys.argv[1:]
    width, height = int(width), int(height)
    camera = gltf.find_camera(gltf.scene_of(gltf.Glb(path))[2], camera_name, path)
    scene = mi.load_dict(mitsuba_scene.scene_dict(path, folder, plain=True))
    pixels = trace(scene, centre_rays(camera, width, height), width * height, int(spp), int(depth))
    pixels.astype("<f4").tofile(out)


if __name__ == "__main__":
    main()
