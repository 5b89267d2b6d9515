"""Writes Blender's own tangents of some meshes, which the test gltf_tangents_test holds the loader's to.

blender --background --factory-startup --python tests/blender/make_tangents.py -- tests/librcs/blender_tangents.json
"""

import json
import math
import sys

import bpy  # before bmesh, which is a part of it

import bmesh
from mathutils import Vector, noise


def mapped(name, build, uv_of):
    """A triangulated mesh. @param uv_of  of a face's number and a corner's place"""
    work = bmesh.new()
    build(work)
    bmesh.ops.triangulate(work, faces=work.faces[:])
    layer = work.loops.layers.uv.new("map")
    for number, face in enumerate(work.faces):
        face.smooth = True
        for loop in face.loops:
            loop[layer].uv = uv_of(number, loop.vert.co, face.calc_center_median())
    mesh = bpy.data.meshes.new(name)
    work.to_mesh(mesh)
    return mesh


def ball(work):
    bmesh.ops.create_uvsphere(work, u_segments=8, v_segments=5, radius=1.0)
    for vertex in work.verts:
        vertex.co *= 1.0 + 0.3 * noise.noise(2.0 * vertex.co + Vector((0.3, 0.1, 0.7)))


def round_about(number, place, middle):
    """With a seam where the angle begins anew."""
    angle = math.atan2(place.y, place.x) / (2.0 * math.pi)
    if math.hypot(place.x, place.y) < 1e-4:
        angle = math.atan2(middle.y, middle.x) / (2.0 * math.pi)
    if middle.y > 0.0 and angle < -0.25 or middle.x < 0.0 and middle.y > 0.0 and angle < 0.0:
        angle += 1.0
    return (angle, math.asin(max(-1.0, min(1.0, place.normalized().z))) / math.pi)


def cube(work):
    bmesh.ops.create_cube(work, size=2.0)
    bmesh.ops.subdivide_edges(work, edges=work.edges[:], cuts=1, use_grid_fill=True)


def mirrored(number, place, middle):
    """The same picture on both halves, one in a mirror; two triangles without a picture."""
    if number in (3, 17):
        return (0.25, 0.25)
    axis = max(range(3), key=lambda k: abs(middle[k]))
    u, v = (abs(place[k]) if k == 0 else place[k] for k in range(3) if k != axis)
    return (0.5 * u + 0.1 * v, 0.4 * v - 0.2 * u)


def corners(mesh):
    mesh.calc_tangents(uvmap="map")
    uvs = mesh.uv_layers["map"].data

    def rounded(values):
        return [float(f"{value:.9g}") for value in values]

    assert all(len(polygon.loop_indices) == 3 for polygon in mesh.polygons)
    found = []
    for loop in mesh.loops:
        place = mesh.vertices[loop.vertex_index].co
        found.append(rounded([*place, *loop.normal, *uvs[loop.index].uv, *loop.tangent, loop.bitangent_sign]))
    return found


meshes = [mapped("ball with a seam", ball, round_about), mapped("cube in a mirror", cube, mirrored)]
lines = [json.dumps(mesh.name) + ": [\n" + ",\n".join(json.dumps(corner, separators=(",", ":"))
                                                  for corner in corners(mesh)) + "\n]" for mesh in meshes]
with open(sys.argv[-1], "w") as file:
    file.write("{\n" + ",\n".join(lines) + "\n}\n")
