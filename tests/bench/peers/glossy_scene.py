"""A small glTF scene of glossy surfaces, for comparisons of their transport."""

import numpy as np

import gltf


def sphere(rows=48):
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rows + 1), np.linspace(0, 2 * np.pi, 2 * rows + 1), indexing="ij")
    points = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rows), np.arange(2 * rows), indexing="ij")
    a = (i * (2 * rows + 1) + j).ravel()
    b = a + 2 * rows + 1
    quads = np.concatenate([np.stack([a, b, a + 1], 1), np.stack([a + 1, b, b + 1], 1)])
    corner = points[quads]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    return points, points, quads[area > 1e-9]


def box_room(low, high):
    positions, normals, triangles = [], [], []
    for axis in range(3):
        for side in (0, 1):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            quad = np.zeros((4, 3))
            quad[:, axis] = (low, high)[side][axis]
            quad[[1, 2], u], quad[[0, 3], u] = high[u], low[u]
            quad[[2, 3], v], quad[[0, 1], v] = high[v], low[v]
            first, order = len(positions) * 4, (0, 1, 2, 0, 2, 3) if side == 0 else (0, 2, 1, 0, 3, 2)
            triangles += [[first + k for k in order[:3]], [first + k for k in order[3:]]]
            positions.append(quad)
            normals.append(np.tile((1 - 2 * side) * np.eye(3)[axis], (4, 1)))
    return np.concatenate(positions), np.concatenate(normals), np.array(triangles)


# What is anisotropic is wider along the cross product of this and the normal.
AXIS = (0.3, 1.0, 0.2)

ROUGHNESSES = (0.1, 0.3, 0.6, 1.0)


def panel(width=0.34, height=0.7):
    """Upright, towards +z."""
    points = np.array([[-width, 0, 0], [width, 0, 0], [width, height, 0], [-width, height, 0]])
    return points, np.tile([0.0, 0.0, 1.0], (4, 1)), np.array([[0, 1, 2], [0, 2, 3]])


def lobe_extension(lobe, roughness, row):
    """A glTF extension over roughness, the second row weaker. @return (extensions, roughness of the base)"""
    if lobe == "sheen":
        color = [0.9, 0.7, 1.0] if row == 0 else [0.2, 0.4, 0.3]
        return {"KHR_materials_sheen": {"sheenColorFactor": color, "sheenRoughnessFactor": roughness}}, 0.7
    if lobe == "anisotropy":
        return {"KHR_materials_anisotropy": {"anisotropyStrength": 0.9 - 0.4 * row}}, roughness
    if lobe == "diffuse-transmission":
        return {"KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.8 - 0.4 * row,
                                                       "diffuseTransmissionColorFactor": [0.9, 0.8, 0.3]}}, roughness
    return {}, roughness


def write_glossy(path, lobe="glossy"):
    """Metal and dielectric spheres, roughness 0.1 to 1, on a glossy floor in a room with a lamp and a spot. With the
    name of a lobe the spheres, or panels where light goes through, have that one."""
    buffer, views, accessors, meshes, nodes, materials = b"", [], [], [], [], []

    def accessor(values, kind, component):
        nonlocal buffer
        data = values.astype(gltf.COMPONENTS[component]).tobytes()
        views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(data)})
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(values), "type": kind,
                          "min": values.min(0).tolist(), "max": values.max(0).tolist()} if kind != "SCALAR" else
                         {"bufferView": len(views) - 1, "componentType": component, "count": len(values), "type": kind})
        buffer += data + b"\0" * (-len(data) % 4)
        return len(accessors) - 1

    def add(shape, material, **node):
        positions, normals, triangles = shape
        materials.append(material)
        tangents = np.cross(AXIS, normals)
        tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
        tangents = np.concatenate([tangents, np.ones((len(normals), 1))], 1)
        meshes.append({"primitives": [{
            "attributes": {"POSITION": accessor(positions.astype(np.float32), "VEC3", 5126),
                           "NORMAL": accessor(normals.astype(np.float32), "VEC3", 5126),
                           "TANGENT": accessor(tangents.astype(np.float32), "VEC4", 5126)},
            "indices": accessor(triangles.reshape(-1, 1), "SCALAR", 5125), "material": len(materials) - 1}]})
        nodes.append({"mesh": len(meshes) - 1, **node})

    def surface(color, roughness, metallic=0.0, **more):
        return {"doubleSided": True, "pbrMetallicRoughness": {"baseColorFactor": [*color, 1.0],
                                                              "roughnessFactor": roughness,
                                                              "metallicFactor": metallic}, **more}

    quad = lambda y, s, up: (np.array([[-s, y, -s], [-s, y, s], [s, y, s], [s, y, -s]]), np.tile([0, up, 0], (4, 1)),
                             np.array([[0, 1, 2], [0, 2, 3]] if up > 0 else [[0, 2, 1], [0, 3, 2]]))
    add(box_room((-2.5, 0, -2.5), (2.5, 2.5, 2.5)), surface((0.6, 0.55, 0.5), 1.0))
    add(quad(0.001, 2.49, 1), surface((0.3, 0.35, 0.45), 0.25))
    lamp = surface((0.0, 0.0, 0.0), 1.0, emissiveFactor=[1.0, 0.9, 0.8])
    lamp.update(doubleSided=False, extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 12.0}})
    add(quad(2.45, 0.4, -1), lamp)
    for i, roughness in enumerate(ROUGHNESSES):
        for row in (0, 1):
            extensions, own = lobe_extension(lobe, roughness, row)
            metallic = float(row) if lobe in ("glossy", "anisotropy") else 0.0
            color = (0.9, 0.7, 0.4) if metallic else (0.2, 0.4, 0.6)
            material = surface(color, own, metallic, **({"extensions": extensions} if extensions else {}))
            x = -1.2 + 0.8 * i
            if lobe == "diffuse-transmission":
                add(panel(), material, translation=[x, 0.05 + 0.85 * row, 0.3 - 0.4 * row])
            else:
                add(sphere(), material, translation=[x, 0.36 + 0.8 * row, -0.6 * row], scale=[0.35, 0.35, 0.35])
    nodes.append({"camera": 0, "translation": [0, 1.2, 2.4], "rotation": [-0.05, 0, 0, 0.99875]})
    nodes.append({"extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [1.5, 2.2, 1.5],
                  "rotation": [-0.5, 0.3, 0.15, 0.798]})
    nodes[-1]["rotation"] = (np.array(nodes[-1]["rotation"]) / np.linalg.norm(nodes[-1]["rotation"])).tolist()
    document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes,
                "meshes": meshes, "materials": materials, "accessors": accessors, "bufferViews": views,
                "buffers": [{"byteLength": len(buffer)}],
                "cameras": [{"type": "perspective", "perspective": {"yfov": 1.1, "znear": 0.01}}],
                "extensionsUsed": sorted({"KHR_lights_punctual"}.union(*(m.get("extensions", {}) for m in materials))),
                "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 6.0, "spot": {
                    "innerConeAngle": 0.3, "outerConeAngle": 0.6}}]}}}
    gltf.write_glb(path, document, buffer)
