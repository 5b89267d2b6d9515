"""A Lambertian glTF scene as Radiance's own text: plastic without gloss, lights, one triangle mesh, a view."""

import subprocess

import numpy as np

import gltf

SUN_DEGREES = 0.02  # diameter of directional lights, which Radiance has as distant discs; a fifteenth of the real sun's
LAMP_RADIUS = 0.001  # of point lights, which it has as spheres [m]

# Share of a spot's intensity along a ray towards it: KHR_lights_punctual's square of a ramp in the cosine.
SPOT_CAL = """ramp = (-Dx*A1 - Dy*A2 - Dz*A3 - A5) / (A4 - A5);
spot = if(ramp, if(1 - ramp, ramp*ramp, 1), 0);
"""


def numbers(values):
    return " ".join(f"{float(value):.9g}" for value in values)


def lamp_text(name, light):
    if light.kind == "directional":
        solid_angle = 2 * np.pi * (1 - np.cos(np.radians(SUN_DEGREES / 2)))
        return (f"void light {name} 0 0 3 {numbers(light.color / solid_angle)}\n"
                f"{name} source {name}s 0 0 4 {numbers(-light.axis)} {SUN_DEGREES}\n")
    radiance = light.color / (np.pi * LAMP_RADIUS ** 2)
    text, modifier = "", "void"
    if light.kind == "spot":
        inner = max(np.cos(light.inner), np.cos(light.outer) + 1e-3)
        text = f"void brightfunc {name}f 2 spot spot.cal 0 5 {numbers(light.axis)} {inner} {np.cos(light.outer)}\n"
        modifier = name + "f"
    return (text + f"{modifier} light {name} 0 0 3 {numbers(radiance)}\n"
            f"{name} sphere {name}s 0 0 4 {numbers(light.position)} {LAMP_RADIUS}\n")


def emissive_triangles(name, mesh):
    """Meshes cannot be light sources in Radiance: a lamp is written as polygons, which emit on their front only."""
    return "".join(f"{name} polygon {name}p{i} 0 0 9 {numbers(corners.ravel())}\n"
                   for i, corners in enumerate(mesh.positions[mesh.triangles]))


def write_obj(file, mesh, offsets, modifier):
    """Appends a mesh; `offsets` counts the positions and normals written so far."""
    file.write(f"usemtl {modifier}\n")
    file.writelines(f"v {numbers(p)}\n" for p in mesh.positions)
    file.writelines(f"vn {numbers(n)}\n" for n in (mesh.normals if mesh.normals is not None else ()))
    for triangle in mesh.triangles:
        if mesh.normals is None:
            file.write("f " + " ".join(str(offsets[0] + i + 1) for i in triangle) + "\n")
        else:
            file.write("f " + " ".join(f"{offsets[0] + i + 1}//{offsets[1] + i + 1}" for i in triangle) + "\n")
    offsets[0] += len(mesh.positions)
    offsets[1] += 0 if mesh.normals is None else len(mesh.normals)


def view_text(camera, aspect):
    horizontal = 2 * np.arctan(np.tan(camera.yfov / 2) * aspect)
    return (f"-vtv -vp {numbers(camera.eye)} -vd {numbers(camera.forward)} -vu {numbers(camera.up)} "
            f"-vh {np.degrees(horizontal):.9g} -vv {np.degrees(camera.yfov):.9g}")


def write_scene(glb, folder):
    """materials.rad, scene.obj and scene.rad in `folder`."""
    meshes, lights, _ = gltf.scene_of(glb)
    (folder / "spot.cal").write_text(SPOT_CAL)
    materials, lamps = "", ""
    offsets = [0, 0]
    with open(folder / "scene.obj", "w") as obj:
        for i, mesh in enumerate(meshes):
            material = gltf.material_of(glb, mesh)
            emitted = gltf.emission(material)
            name = f"m{i}"
            if np.any(emitted > 0):
                lamps += f"void light {name} 0 0 3 {numbers(emitted)}\n" + emissive_triangles(name, mesh)
            else:
                materials += f"void plastic {name} 0 0 5 {numbers(gltf.base_color(material))} 0 0\n"
                write_obj(obj, mesh, offsets, name)
    (folder / "materials.rad").write_text(materials)
    lamps += "".join(lamp_text(f"l{i}", light) for i, light in enumerate(lights))
    (folder / "scene.rad").write_text(lamps + "void mesh scene 1 scene.rtm 0 0\n")


def build_octree(glb, folder, bin_folder, environment):
    write_scene(glb, folder)
    run = lambda command: subprocess.run(command, cwd=folder, env=environment, check=True, stderr=subprocess.PIPE)
    run([bin_folder / "obj2mesh", "-a", "materials.rad", "scene.obj", "scene.rtm"])
    with open(folder / "scene.oct", "wb") as octree:
        subprocess.run([bin_folder / "oconv", "scene.rad"], cwd=folder, env=environment, check=True, stdout=octree)
