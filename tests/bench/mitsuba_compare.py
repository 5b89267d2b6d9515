#!/usr/bin/env python3
"""Compares `rcsplat reference` with Mitsuba 3, which shares no line with it: `pip install mitsuba`.

    mitsuba_compare.py --rcsplat build/release/bin/rcsplat ../shared/scenes/cornell-box.glb sponza.glb:atrium glossy

Each scene is a .glb file, with :CAMERA where it has several; `glossy` is made here. For each, both render the same
view with box-filtered pixels. Passes (exit 0) if the means agree within 1 % and the relative mean square error is no
more than the two standard errors explain.

Materials: flat Lambertian surfaces use Mitsuba's own `diffuse`; for all others Mitsuba has no counterpart (its
`principled` and `roughconductor` mask and compensate differently), so Bsdf below states ours again, from the
formulas: GGX with height-correlated masking, Schlick, compensation by albedo tables integrated here with numpy.
What this converter does not read is an error: textures other than base colour, alpha, transmission, clear coat,
double-sided lamps.
"""

import argparse
import json
import os
import struct
import subprocess
import sys
import tempfile

import numpy as np

try:
    import mitsuba as mi
except ImportError:
    sys.exit("mitsuba_compare.py needs Mitsuba 3: pip install mitsuba")

try:
    mi.set_variant("llvm_ad_rgb")
    mi.load_dict({"type": "sphere"})  # fails where no LLVM library is found
except Exception:
    mi.set_variant("scalar_rgb")
import drjit as dr

COMPONENTS = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


# ---------------------------------------------------------------------------------------------- the scene, from glTF

class Glb:
    """A binary glTF file with one buffer."""

    def __init__(self, path):
        with open(path, "rb") as file:
            data = file.read()
        length = struct.unpack_from("<I", data, 12)[0]
        self.json = json.loads(data[20:20 + length])
        self.buffer = data[28 + length:]
        lacking = set(self.json.get("extensionsRequired", []))
        if lacking:
            sys.exit(f"{path}: requires {', '.join(sorted(lacking))}, which this converter does not read")

    def __getitem__(self, name):
        return self.json.get(name, [])

    def view(self, index):
        view = self["bufferViews"][index]
        start = view.get("byteOffset", 0)
        return self.buffer[start:start + view["byteLength"]], view.get("byteStride")

    def accessor(self, index):
        a = self["accessors"][index]
        data, stride = self.view(a["bufferView"])
        dtype, width = np.dtype(COMPONENTS[a["componentType"]]), WIDTHS[a["type"]]
        stride = stride or dtype.itemsize * width
        values = np.ndarray((a["count"], width), dtype, data, a.get("byteOffset", 0), (stride, dtype.itemsize))
        if a.get("normalized"):
            return values.astype(np.float64) / np.iinfo(dtype).max
        return np.array(values)


def node_matrix(node):
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    m = np.eye(4)
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    m[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                 [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                 [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    m[:3, :3] = m[:3, :3] * np.array(node.get("scale", (1, 1, 1)))
    m[:3, 3] = node.get("translation", (0, 0, 0))
    return m


def all_nodes(glb):
    """(node, world matrix) of the default scene."""
    stack = [(i, np.eye(4)) for i in glb["scenes"][glb.json.get("scene", 0)]["nodes"]]
    while stack:
        index, parent = stack.pop()
        node = glb["nodes"][index]
        world = parent @ node_matrix(node)
        stack += [(child, world) for child in node.get("children", [])]
        yield node, world


def material_values(glb, index):
    """Of a glTF material: what Bsdf needs, or sys.exit."""
    m = glb["materials"][index] if index is not None else {}
    name, pbr, ext = m.get("name", "?"), m.get("pbrMetallicRoughness", {}), m.get("extensions", {})
    known = {"KHR_materials_emissive_strength", "KHR_materials_ior", "KHR_materials_specular"}
    unread = [k for k in ("normalTexture", "emissiveTexture") if k in m] + sorted(set(ext) - known)
    unread += ["metallicRoughnessTexture"] if "metallicRoughnessTexture" in pbr else []
    unread += ["alphaMode"] if m.get("alphaMode", "OPAQUE") != "OPAQUE" else []
    unread += [k for k in ext.get("KHR_materials_specular", {}) if k.endswith("Texture")]
    if unread:
        sys.exit(f"material '{name}' has {', '.join(unread)}, which this converter does not read")
    ior = ext.get("KHR_materials_ior", {}).get("ior", 1.5)
    specular = ext.get("KHR_materials_specular", {})
    strength = ext.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
    return {
        "color": pbr.get("baseColorFactor", (1, 1, 1, 1))[:3],
        "texture": pbr.get("baseColorTexture", {}).get("index"),
        "metallic": pbr.get("metallicFactor", 1.0),
        "roughness": pbr.get("roughnessFactor", 1.0),
        "specular": specular.get("specularFactor", 1.0),
        "f0": min(((ior - 1) / (ior + 1)) ** 2, 1.0) * np.array(specular.get("specularColorFactor", (1, 1, 1))),
        "emission": np.array(m.get("emissiveFactor", (0, 0, 0))) * strength,
        "double_sided": m.get("doubleSided", False),
    }


# ------------------------------------------------------------------------------------------------- the BSDF, from formulas

def albedo_table(alpha, count=257):
    """GGX directional albedo split by Schlick's weight, (scale, bias) at cosines (i / (count - 1))^2, by quadrature
    over microfacet slopes."""
    radius, azimuth = np.meshgrid((np.arange(600) + 0.5) / 600, 2 * np.pi * (np.arange(256) + 0.5) / 256)
    slope = alpha * np.sqrt(radius / (1 - radius))  # D cos dh is uniform in `radius`
    cos_h = 1 / np.sqrt(1 + slope * slope)
    hx, hz = slope * cos_h * np.cos(azimuth), cos_h
    smith = lambda c: 0.5 * (np.sqrt(1 + alpha * alpha * (1 / (c * c) - 1)) - 1)
    result = np.zeros((count, 2))
    for i in range(count):
        c = max((i / (count - 1)) ** 2, 1e-5)
        oh = np.sqrt(1 - c * c) * hx + c * hz
        ci = 2 * oh * hz - c
        ok = (oh > 0) & (ci > 0)
        ci_ok = np.where(ok, ci, 1.0)
        g = 1 / (1 + smith(c) + smith(ci_ok))
        value = np.where(ok, g * oh / (c * hz), 0.0)  # D G F / (4 c ci) ci, with dh = di / (4 oh) and D hz dh uniform
        fresnel = (1 - np.clip(oh, 0, 1)) ** 5
        result[i] = np.mean(value * (1 - fresnel)), np.mean(value * fresnel)
    return result


class Bsdf(mi.BSDF):
    """Lambert below GGX, as librcs/src/material/bsdf.h defines them, seen from either side."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.texture = props["texture"] if "texture" in props else None
        self.color = mi.Color3f(*(props[f"color_{c}"] for c in "rgb"))
        self.metallic = props.get("metallic", 0.0)
        self.specular = props.get("specular", 1.0)
        self.dielectric = mi.Color3f(*(props[f"f0_{c}"] for c in "rgb"))
        self.alpha = min(max(props.get("roughness", 1.0) ** 2, 1e-3), 1.0)
        self.f90 = self.specular * (1 - self.metallic) + self.metallic
        table = albedo_table(self.alpha)
        self.scale, self.bias = mi.Float(table[:, 0]), mi.Float(table[:, 1])
        flags = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.GlossyReflection
        flags = flags | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [flags]
        self.m_flags = flags

    def albedo(self, cosine):
        x = dr.sqrt(dr.clip(cosine, 0, 1)) * 256
        i = dr.minimum(mi.UInt32(x), 255)
        look_up = lambda t: dr.lerp(dr.gather(mi.Float, t, i), dr.gather(mi.Float, t, i + 1), x - mi.Float(i))
        return look_up(self.scale), look_up(self.bias)

    def frame(self, si):
        """Shading normal on the viewer's side, bent until the viewer's mirror direction leaves the surface."""
        o = si.to_world(si.wi)
        g = dr.select(dr.dot(si.n, o) < 0, -si.n, si.n)
        n = dr.select(dr.dot(si.n, o) < 0, -si.sh_frame.n, si.sh_frame.n)
        least = dr.minimum(0.01, 0.9 * dr.dot(o, g))
        mirrored = 2 * dr.dot(n, o) * n - o
        elevation = dr.dot(mirrored, g)
        level = dr.normalize(mirrored - elevation * g)
        half = dr.normalize(least * g + dr.sqrt(1 - least * least) * level + o)
        glossy = self.f90 > 0
        return o, g, dr.select(mi.Bool(glossy) & (elevation < least), half, n)

    def values(self, si, active):
        o, g, n = self.frame(si)
        base = self.texture.eval(si, active) if self.texture else self.color
        f0 = dr.lerp(dr.minimum(self.dielectric, 1) * self.specular, base, self.metallic)
        cos_o = dr.clip(dr.dot(n, o), 1e-6, 1)
        scale, bias = self.albedo(cos_o)
        total = scale + bias
        gain = 1 + f0 * (1 - total) / total
        specular = gain * (f0 * scale + self.f90 * bias)
        diffuse = base * (1 - self.metallic) * (1 - specular)
        return o, g, n, cos_o, f0, gain, specular, diffuse

    def lobes(self, si, wo, active):
        """f cos, density."""
        o, g, n, cos_o, f0, gain, specular, diffuse = self.values(si, active)
        i = si.to_world(wo)
        cos_i = dr.dot(n, i)
        valid = active & (cos_i > 0) & (dr.dot(g, i) > 0)
        h = dr.normalize(o + i)
        sine2, oh = dr.squared_norm(dr.cross(n, h)), dr.clip(dr.dot(o, h), 0, 1)
        a2 = self.alpha ** 2
        d = a2 / (dr.pi * dr.square(sine2 + a2 * (1 - sine2)))
        slant = lambda c: dr.sqrt(a2 + (1 - a2) * c * c)
        v = 0.5 / (cos_i * slant(cos_o) + cos_o * slant(cos_i))
        f = f0 + (self.f90 - f0) * (1 - oh) ** 5
        share = dr.mean(diffuse) / (dr.mean(diffuse) + dr.mean(specular))
        value = (diffuse / dr.pi + gain * f * d * v) * cos_i
        density = share * cos_i / dr.pi + (1 - share) * d * 0.5 / (cos_o + slant(cos_o))
        return dr.select(valid, value, 0), dr.select(valid, density, 0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        o, g, n, cos_o, f0, gain, specular, diffuse = self.values(si, active)
        share = dr.mean(diffuse) / (dr.mean(diffuse) + dr.mean(specular))
        frame = mi.Frame3f(n)
        wi = frame.to_local(o)
        microfacets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, True)
        m, _ = microfacets.sample(mi.Vector3f(wi.x, wi.y, dr.maximum(wi.z, 1e-6)), sample2)
        glossy = frame.to_world(mi.reflect(wi, m))
        lambert = frame.to_world(mi.warp.square_to_cosine_hemisphere(sample2))
        bs = mi.BSDFSample3f()
        bs.wo = si.to_local(dr.select(sample1 < share, lambert, glossy))
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        bs.sampled_component = mi.UInt32(0)
        value, bs.pdf = self.lobes(si, bs.wo, active)
        return bs, dr.select(bs.pdf > 0, value / bs.pdf, 0)

    def eval(self, ctx, si, wo, active=True):
        return self.lobes(si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.lobes(si, wo, active)[1]

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.lobes(si, wo, active)

    def traverse(self, callback):
        pass

    def to_string(self):
        return f"Bsdf[alpha={self.alpha}]"


mi.register_bsdf("rcs_bsdf", lambda props: Bsdf(props))


def bsdf_of(values, flat, textures):
    texture = None if values["texture"] is None else textures[values["texture"]]
    color = [float(c) for c in values["color"]]
    if texture and color != [1, 1, 1]:
        sys.exit("a base colour factor besides a texture is not read")
    if values["metallic"] == 0 and values["specular"] == 0 and flat:
        return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": texture or {"type": "rgb", "value": color}}}
    bsdf = {"type": "rcs_bsdf", "metallic": float(values["metallic"]), "specular": float(values["specular"]),
            "roughness": float(values["roughness"])}
    for i, channel in enumerate("rgb"):
        bsdf[f"color_{channel}"], bsdf[f"f0_{channel}"] = color[i], float(values["f0"][i])
    return {**bsdf, "texture": texture} if texture else bsdf


class Spot(mi.Emitter):
    """KHR_lights_punctual's spot: the square of a ramp in the cosine."""

    def __init__(self, props):
        mi.Emitter.__init__(self, props)
        self.position, self.axis = mi.Point3f(props["position"]), mi.Vector3f(props["axis"])
        self.intensity = mi.Color3f(props["r"], props["g"], props["b"])
        self.cos_inner, self.cos_outer = np.cos(props["inner"]), np.cos(props["outer"])
        self.m_flags = +mi.EmitterFlags.DeltaPosition

    def sample_direction(self, it, sample, active=True):
        ds = mi.DirectionSample3f()
        ds.p, ds.n, ds.uv, ds.time, ds.pdf, ds.delta = self.position, 0, 0, it.time, 1.0, True
        ds.emitter = mi.EmitterPtr(self)
        offset = ds.p - it.p
        ds.dist = dr.norm(offset)
        ds.d = offset / ds.dist
        edge = dr.clip((-dr.dot(ds.d, self.axis) - self.cos_outer) / max(self.cos_inner - self.cos_outer, 0.001), 0, 1)
        return ds, dr.select(active, self.intensity * edge * edge / dr.square(ds.dist), 0)

    def pdf_direction(self, it, ds, active=True):
        return mi.Float(0)

    def eval(self, si, active=True):
        return mi.Color3f(0)

    def eval_direction(self, it, ds, active=True):
        return mi.Color3f(0)

    def bbox(self):
        return mi.BoundingBox3f()

    def traverse(self, callback):
        pass

    def to_string(self):
        return "Spot"


mi.register_emitter("gltf_spot", lambda props: Spot(props))


# --------------------------------------------------------------------------------------------------- glTF -> Mitsuba

def load_textures(glb, folder):
    textures = []
    for i, texture in enumerate(glb["textures"]):
        sampler = glb["samplers"][texture["sampler"]] if "sampler" in texture else {}
        if {sampler.get("wrapS", 10497), sampler.get("wrapT", 10497)} != {10497}:
            sys.exit(f"texture {i} does not repeat")
        image = glb["images"][texture["source"]]
        path = os.path.join(folder, f"{i}." + image["mimeType"].split("/")[1].replace("jpeg", "jpg"))
        with open(path, "wb") as file:
            file.write(glb.view(image["bufferView"])[0])
        textures.append({"type": "bitmap", "filename": path, "wrap_mode": "repeat"})
    return textures


def write_ply(path, positions, normals, uvs, triangles):
    columns, names = [positions], ["x", "y", "z"]
    if normals is not None:
        columns.append(normals)
        names += ["nx", "ny", "nz"]
    if uvs is not None:
        columns.append(uvs)
        names += ["u", "v"]
    header = "ply\nformat binary_little_endian 1.0\n" + f"element vertex {len(positions)}\n"
    header += "".join(f"property float {n}\n" for n in names)
    header += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    faces = np.empty(len(triangles), [("n", "u1"), ("i", "<i4", 3)])
    faces["n"], faces["i"] = 3, triangles
    with open(path, "wb") as file:
        file.write(header.encode())
        file.write(np.hstack(columns).astype("<f4").tobytes())
        file.write(faces.tobytes())


def add_primitive(scene, glb, primitive, world, textures, folder):
    name = f"mesh{len(scene)}"
    a = primitive["attributes"]
    if primitive.get("mode", 4) != 4 or "COLOR_0" in a:
        sys.exit("only triangles without vertex colours are read")
    positions = glb.accessor(a["POSITION"]) @ world[:3, :3].T + world[:3, 3]
    triangles = (glb.accessor(primitive["indices"]).reshape(-1, 3) if "indices" in primitive
                 else np.arange(len(positions)).reshape(-1, 3)).astype(np.int64)
    normals = uvs = None
    flat = True
    if "NORMAL" in a:
        normals = glb.accessor(a["NORMAL"]) @ np.linalg.inv(world[:3, :3])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        corner = positions[triangles]
        face = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        face /= np.maximum(np.linalg.norm(face, axis=1, keepdims=True), 1e-30)
        side = 1 if np.linalg.det(world[:3, :3]) > 0 else -1
        flat = bool(np.all(np.abs(normals[triangles] - side * face[:, None]).max(axis=(1, 2)) < 1e-4))
    if "TEXCOORD_0" in a:
        uvs = glb.accessor(a["TEXCOORD_0"])
    if np.linalg.det(world[:3, :3]) < 0:
        triangles = triangles[:, [0, 2, 1]]  # fronts stay fronts
    values = material_values(glb, primitive.get("material"))
    path = os.path.join(folder, name + ".ply")
    write_ply(path, positions, None if flat else normals, uvs, triangles)
    shape = {"type": "ply", "filename": path, "face_normals": flat, "bsdf": bsdf_of(values, flat, textures)}
    if np.any(values["emission"] > 0):
        if values["double_sided"]:
            sys.exit("double-sided lamps are not read")
        shape["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": [float(x) for x in values["emission"]]}}
    scene[name] = shape


def add_light(scene, light, world):
    color = np.array(light.get("color", (1, 1, 1))) * light.get("intensity", 1.0)
    rgb = {"type": "rgb", "value": [float(c) for c in color]}
    axis = -world[:3, 2] / np.linalg.norm(world[:3, 2])
    name, position = f"light{len(scene)}", [float(x) for x in world[:3, 3]]
    if "range" in light:
        sys.exit("lights with a range are not read")
    if light["type"] == "directional":
        scene[name] = {"type": "directional", "direction": [float(x) for x in axis], "irradiance": rgb}
    elif light["type"] == "point":
        scene[name] = {"type": "point", "position": position, "intensity": rgb}
    else:
        spot = light.get("spot", {})
        scene[name] = {"type": "gltf_spot", "position": mi.ScalarPoint3f(position), "axis": mi.ScalarVector3f(axis.tolist()),
                       "r": float(color[0]), "g": float(color[1]), "b": float(color[2]),
                       "inner": float(spot.get("innerConeAngle", 0.0)), "outer": float(spot.get("outerConeAngle", np.pi / 4))}


def mitsuba_scene(path, camera, size, sky, folder):
    glb = Glb(path)
    scene = {"type": "scene"}
    textures = load_textures(glb, folder)
    lights = glb.json.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
    sensor = None
    for node, world in all_nodes(glb):
        if "mesh" in node:
            for primitive in glb["meshes"][node["mesh"]]["primitives"]:
                add_primitive(scene, glb, primitive, world, textures, folder)
        if "KHR_lights_punctual" in node.get("extensions", {}):
            add_light(scene, lights[node["extensions"]["KHR_lights_punctual"]["light"]], world)
        if "camera" in node and sensor is None:
            c = glb["cameras"][node["camera"]]
            if camera is None or camera in (c.get("name"), node.get("name")):
                turned = world @ np.diag([-1.0, 1.0, -1.0, 1.0])  # Mitsuba looks along +z, x to the left
                sensor = {"type": "perspective", "fov_axis": "y", "fov": float(np.degrees(c["perspective"]["yfov"])),
                          "near_clip": 1e-3, "far_clip": 1e5, "to_world": mi.ScalarTransform4f(turned.tolist()),
                          "sampler": {"type": "independent"},
                          "film": {"type": "hdrfilm", "width": size, "height": size, "pixel_format": "rgb",
                                   "component_format": "float32", "rfilter": {"type": "box"}}}
    if sensor is None:
        sys.exit(f"{path}: no camera '{camera}'")
    scene["sensor"] = sensor
    if sky > 0:
        scene["sky"] = {"type": "constant", "radiance": {"type": "rgb", "value": sky}}
    return mi.load_dict(scene)


def render_mitsuba(scene, bounces, samples):
    """Mean and standard error, from 16 independent images."""
    integrator = mi.load_dict({"type": "path", "max_depth": bounces + 2, "rr_depth": 1000})
    images = np.stack([np.array(mi.render(scene, integrator=integrator, spp=max(samples // 16, 1), seed=s + 1),
                                np.float64)[..., :3] for s in range(16)])
    return images.mean(0), images.std(0, ddof=1) / 4.0


# ---------------------------------------------------------------------------------------------------- a glossy scene

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


def write_glossy(path):
    """Metal and dielectric spheres, roughness 0.1 to 1, on a glossy floor in a room with a lamp and a spot."""
    buffer, views, accessors, meshes, nodes, materials = b"", [], [], [], [], []

    def accessor(values, kind, component):
        nonlocal buffer
        data = values.astype(COMPONENTS[component]).tobytes()
        views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(data)})
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(values), "type": kind,
                          "min": values.min(0).tolist(), "max": values.max(0).tolist()} if kind != "SCALAR" else
                         {"bufferView": len(views) - 1, "componentType": component, "count": len(values), "type": kind})
        buffer += data + b"\0" * (-len(data) % 4)
        return len(accessors) - 1

    def add(shape, material, **node):
        positions, normals, triangles = shape
        materials.append(material)
        meshes.append({"primitives": [{
            "attributes": {"POSITION": accessor(positions.astype(np.float32), "VEC3", 5126),
                           "NORMAL": accessor(normals.astype(np.float32), "VEC3", 5126)},
            "indices": accessor(triangles.reshape(-1, 1), "SCALAR", 5125), "material": len(materials) - 1}]})
        nodes.append({"mesh": len(meshes) - 1, **node})

    def surface(color, roughness, metallic=0.0, **more):
        return {"doubleSided": True, "pbrMetallicRoughness": {"baseColorFactor": [*color, 1.0], "roughnessFactor": roughness,
                                                              "metallicFactor": metallic}, **more}

    quad = lambda y, s, up: (np.array([[-s, y, -s], [-s, y, s], [s, y, s], [s, y, -s]]), np.tile([0, up, 0], (4, 1)),
                             np.array([[0, 1, 2], [0, 2, 3]] if up > 0 else [[0, 2, 1], [0, 3, 2]]))
    add(box_room((-2.5, 0, -2.5), (2.5, 2.5, 2.5)), surface((0.6, 0.55, 0.5), 1.0))
    add(quad(0.001, 2.49, 1), surface((0.3, 0.35, 0.45), 0.25))
    lamp = surface((0.0, 0.0, 0.0), 1.0, emissiveFactor=[1.0, 0.9, 0.8])
    lamp.update(doubleSided=False, extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 12.0}})
    add(quad(2.45, 0.4, -1), lamp)
    for i, roughness in enumerate((0.1, 0.3, 0.6, 1.0)):
        for metallic in (0.0, 1.0):
            color = (0.9, 0.7, 0.4) if metallic else (0.2, 0.4, 0.6)
            add(sphere(), surface(color, roughness, metallic), translation=[-1.2 + 0.8 * i, 0.36 + 0.8 * metallic, -0.6 * metallic],
                scale=[0.35, 0.35, 0.35])
    nodes.append({"camera": 0, "translation": [0, 1.2, 2.4], "rotation": [-0.05, 0, 0, 0.99875]})
    nodes.append({"extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [1.5, 2.2, 1.5],
                  "rotation": [-0.5, 0.3, 0.15, 0.798]})
    nodes[-1]["rotation"] = (np.array(nodes[-1]["rotation"]) / np.linalg.norm(nodes[-1]["rotation"])).tolist()
    document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes,
                "meshes": meshes, "materials": materials, "accessors": accessors, "bufferViews": views,
                "buffers": [{"byteLength": len(buffer)}],
                "cameras": [{"type": "perspective", "perspective": {"yfov": 1.1, "znear": 0.01}}],
                "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_emissive_strength"],
                "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 6.0, "spot": {
                    "innerConeAngle": 0.3, "outerConeAngle": 0.6}}]}}}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as file:
        file.write(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(buffer)))
        file.write(struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(buffer), 0x4E4942) + buffer)


# --------------------------------------------------------------------------------------------------------- comparison

def read_reference(path):
    layers = {name: np.array(bitmap, np.float64)[..., :3] for name, bitmap in mi.Bitmap(path).split()}
    beauty = layers.get("beauty", layers.get("<root>"))
    return beauty, layers["standard_error"]


def compare(scene, options, folder):
    path, _, camera = scene.partition(":")
    if path == "glossy":
        path = os.path.join(folder, "glossy.glb")
        write_glossy(path)
    exr = os.path.join(folder, "reference.exr")
    command = [options.rcsplat, "reference", path, "--size", f"{options.size}x{options.size}", "--spp", str(options.spp),
               "--bounces", str(options.bounces), "--aa", "64", "--pixel-format", "float", "-q", "-o", exr]
    command += ["--environment", f"{options.sky},{options.sky},{options.sky}" if options.sky > 0 else "none"]
    subprocess.run(command + (["--camera", camera] if camera else []), check=True)
    ours, our_error = read_reference(exr)
    theirs, their_error = render_mitsuba(mitsuba_scene(path, camera or None, options.size, options.sky, folder),
                                         options.bounces, options.spp)
    if options.keep:
        name = os.path.join(options.keep, os.path.basename(path).replace(".glb", "") + (f"-{camera}" if camera else ""))
        mi.Bitmap(theirs.astype(np.float32)).write(name + "-mitsuba.exr")
        mi.Bitmap(ours.astype(np.float32)).write(name + "-rcsplat.exr")
    epsilon = 0.01 * theirs.mean()
    scale = theirs ** 2 + epsilon ** 2
    found = np.mean((ours - theirs) ** 2 / scale)
    explained = np.mean((our_error ** 2 + their_error ** 2) / scale)
    mean_error = np.sqrt((our_error ** 2 + their_error ** 2).sum()) / theirs.sum()
    ratio = ours.mean() / theirs.mean()
    # 16 images tell their standard error within 18 %: relMSE, its square, within some 40 %.
    good = abs(ratio - 1) < 0.01 and found < 1.4 * explained
    print(f"{os.path.basename(scene):28} {theirs.mean():9.5f} {ratio:9.4f} {mean_error:9.4f} {found:11.3e} {explained:11.3e}"
          f"  {'ok' if good else 'DIFFERS'}", flush=True)
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", metavar="FILE.glb[:CAMERA]|glossy")
    parser.add_argument("--rcsplat", default="build/release/bin/rcsplat")
    parser.add_argument("--size", type=int, default=160)
    parser.add_argument("--spp", type=int, default=1024)
    parser.add_argument("--bounces", type=int, default=3)
    parser.add_argument("--sky", type=float, default=0.0, help="constant radiance of the sky")
    parser.add_argument("--keep", metavar="FOLDER", help="write both images there")
    options = parser.parse_args()
    print(f"{'scene':28} {'mean':>9} {'ratio':>9} {'+-':>9} {'relMSE':>11} {'explained':>11}")
    good = True
    for scene in options.scenes:
        with tempfile.TemporaryDirectory() as folder:
            good = compare(scene, options, folder) and good
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
