"""POV-Ray's radiosity. It has no lamps with area of a given radiance and no spots that fade as glTF's do: scenes with
such lights are left out."""

import shutil
import subprocess

import numpy as np

import gltf
import images
import processes
from job import Job, Run

# From coarse to fine.
SETTINGS = [
    "count 50 nearest_count 10 error_bound 0.8 pretrace_end 0.02",
    "count 150 nearest_count 8 error_bound 0.5 pretrace_end 0.01",
]
# One bounce, grey thresholds and brightness as transport asks.
COMMON = "recursion_limit 1 gray_threshold 0 brightness 1 low_error_factor 0.5 minimum_reuse 0.005 pretrace_start 0.08"
HEADER = """#version 3.7;
global_settings { assumed_gamma 1 #ifdef (Settings) radiosity { #include "settings.inc" } #end }
"""
MIRRORED = np.array([1, 1, -1])  # from glTF's axes to POV-Ray's left-handed ones: in z
NEAR = 1e-3  # distance from which POV-Ray's lamps fade with the square of the distance [m]


def missing(job: Job):
    if shutil.which("povray") is None:
        return "no POV-Ray: apt-get install povray"
    glb = gltf.Glb(job.glb)
    if any(light.kind == "spot" for light in gltf.scene_of(glb)[1]):
        return "POV-Ray's spots fade otherwise than glTF's"
    if any(np.any(gltf.emission(material) > 0) for material in glb["materials"]):
        return "POV-Ray has no lamps with area of a given radiance"
    return None


def version(_job):
    result = subprocess.run(["povray", "--version"], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    return next(line for line in result.stdout.splitlines() if line.startswith("POV-Ray"))


def vector(values):
    return "<" + ",".join(f"{float(v):.9g}" for v in values) + ">"


def write_mesh(file, mesh, color):
    """POV-Ray's axes are left-handed: all is mirrored, and so seen as it is."""
    block = lambda name, rows: file.write(f"{name} {{ {len(rows)}, {','.join(map(vector, rows))} }}\n")
    file.write("mesh2 {\n")
    block("vertex_vectors", mesh.positions * MIRRORED)
    if mesh.normals is not None:
        block("normal_vectors", mesh.normals * MIRRORED)
    block("face_indices", mesh.triangles)
    file.write(f"texture {{ pigment {{ color rgb {vector(color)} }} "
               "finish { ambient 0 emission 0 diffuse 1 } } }\n")


def light_text(light):
    """POV-Ray's diffuse reflection lacks the 1/pi of radiance; its lamps fade as 2 (NEAR/d)^2."""
    if light.kind == "directional":
        far = -1e4 * light.axis * MIRRORED
        return (f"light_source {{ {vector(far)} color rgb {vector(light.color / np.pi)} parallel "
                f"point_at {vector(far + light.axis * MIRRORED)} }}\n")
    strength = light.color / np.pi / (2 * NEAR ** 2)
    return (f"light_source {{ {vector(light.position * MIRRORED)} color rgb {vector(strength)} "
            f"fade_distance {NEAR} fade_power 2 }}\n")


def camera_text(camera, aspect):
    tangent = np.tan(camera.yfov / 2)
    return (f"camera {{ perspective location {vector(camera.eye * MIRRORED)} "
            f"right {vector(2 * tangent * aspect * camera.right * MIRRORED)} "
            f"up {vector(2 * tangent * camera.up * MIRRORED)} "
            f"direction {vector(camera.forward * MIRRORED)} }}\n")


def write_scene(job: Job, path, glb):
    meshes, lights, cameras = gltf.scene_of(glb)
    with open(path, "w") as file:
        file.write(HEADER)
        file.write(camera_text(gltf.find_camera(cameras, job.camera, job.glb), job.width / job.height))
        file.writelines(light_text(light) for light in lights)
        for mesh in meshes:
            write_mesh(file, mesh, gltf.base_color(gltf.material_of(glb, mesh)))


def render(job: Job, folder, name, radiosity):
    """Cost and picture. Half floats are what POV-Ray's EXR holds."""
    out = folder / f"{name}.exr"
    switches = ["-D", "-A", "-J", "+FE", f"+W{job.width}", f"+H{job.height}", f"+WT{job.threads}"]
    declared = ["Declare=Settings=1"] if radiosity else []
    cost = processes.timed(["povray", "+Iscene.pov", f"+O{out.name}", *switches, *declared], cwd=folder,
                           log=folder / f"{name}.log")
    return cost, out


def runs(job: Job):
    folder = job.folder / "povray"
    folder.mkdir(exist_ok=True)
    write_scene(job, folder / "scene.pov", gltf.Glb(job.glb))
    _, direct = render(job, folder, "direct", radiosity=False)
    for i, options in enumerate(SETTINGS):
        (folder / "settings.inc").write_text(f"{COMMON} {options}\n")
        cost, picture = render(job, folder, f"radiosity_{i}", radiosity=True)
        image = job.folder / f"povray_{i}.exr"
        images.write_difference(image, picture, direct)
        yield Run("POV-Ray radiosity", options, job.threads, cost, image)
