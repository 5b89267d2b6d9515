"""A glTF scene as Mitsuba's. Flat Lambertian surfaces use Mitsuba's own `diffuse`, all others Bsdf of mitsuba_bsdf.
What is not read is an error: textures other than base colour, alpha, transmission, clear coat, double-sided lamps."""

import os
import sys

import drjit as dr
import mitsuba as mi
import numpy as np

import gltf
import mitsuba_bsdf  # registers rcs_bsdf


def material_values(glb, index):
    """Of a glTF material: what the scene needs, or sys.exit."""
    m = glb["materials"][index] if index is not None else {}
    name, pbr, ext = m.get("name", "?"), m.get("pbrMetallicRoughness", {}), m.get("extensions", {})
    known = {"KHR_materials_emissive_strength", "KHR_materials_ior", "KHR_materials_specular", "KHR_materials_sheen",
             "KHR_materials_anisotropy", "KHR_materials_diffuse_transmission"}
    unread = [k for k in ("normalTexture", "emissiveTexture") if k in m] + sorted(set(ext) - known)
    unread += ["metallicRoughnessTexture"] if "metallicRoughnessTexture" in pbr else []
    unread += ["alphaMode"] if m.get("alphaMode", "OPAQUE") != "OPAQUE" else []
    unread += [k for name in known for k in ext.get(name, {}) if k.endswith(("Texture", "Rotation"))]
    if unread:
        sys.exit(f"material '{name}' has {', '.join(unread)}, which this converter does not read")
    ior = ext.get("KHR_materials_ior", {}).get("ior", 1.5)
    specular = ext.get("KHR_materials_specular", {})
    return {
        "color": pbr.get("baseColorFactor", (1, 1, 1, 1))[:3],
        "texture": pbr.get("baseColorTexture", {}).get("index"),
        "metallic": pbr.get("metallicFactor", 1.0),
        "roughness": pbr.get("roughnessFactor", 1.0),
        "specular": specular.get("specularFactor", 1.0),
        "f0": min(((ior - 1) / (ior + 1)) ** 2, 1.0) * np.array(specular.get("specularColorFactor", (1, 1, 1))),
        "sheen": sheen_of(ext.get("KHR_materials_sheen", {})),
        "anisotropy": float(ext.get("KHR_materials_anisotropy", {}).get("anisotropyStrength", 0.0)),
        "through": through_of(ext.get("KHR_materials_diffuse_transmission", {})),
        "emission": gltf.emission(m),
        "double_sided": m.get("doubleSided", False),
    }


def sheen_of(extension):
    """As the properties of rcs_bsdf."""
    color = extension.get("sheenColorFactor", (0, 0, 0))
    roughness = {"sheen_roughness": float(extension.get("sheenRoughnessFactor", 0.0))}
    return {**roughness, **{f"sheen_{c}": float(color[i]) for i, c in enumerate("rgb")}}


def through_of(extension):
    color = extension.get("diffuseTransmissionColorFactor", (1, 1, 1))
    part = {"through": float(extension.get("diffuseTransmissionFactor", 0.0))}
    return {**part, **{f"through_{c}": float(color[i]) for i, c in enumerate("rgb")}}


def bsdf_of(values, flat, textures):
    texture = None if values["texture"] is None else textures[values["texture"]]
    color = [float(c) for c in values["color"]]
    if texture and color != [1, 1, 1]:
        sys.exit("a base colour factor besides a texture is not read")
    is_lambertian = not any((values["metallic"], values["specular"], values["through"]["through"],
                             *(values["sheen"][f"sheen_{c}"] for c in "rgb")))
    if is_lambertian and flat:
        return {"type": "twosided", "bsdf": {"type": "diffuse",
                                             "reflectance": texture or {"type": "rgb", "value": color}}}
    bsdf = {"type": "rcs_bsdf", "metallic": float(values["metallic"]), "specular": float(values["specular"]),
            "roughness": float(values["roughness"]), "anisotropy": values["anisotropy"], **values["sheen"],
            **values["through"]}
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


def write_ply(path, mesh):
    columns, names = [mesh.positions], ["x", "y", "z"]
    if mesh.normals is not None:
        columns.append(mesh.normals)
        names += ["nx", "ny", "nz"]
    if mesh.uvs is not None:
        columns.append(mesh.uvs)
        names += ["u", "v"]
    header = "ply\nformat binary_little_endian 1.0\n" + f"element vertex {len(mesh.positions)}\n"
    header += "".join(f"property float {n}\n" for n in names)
    header += f"element face {len(mesh.triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    faces = np.empty(len(mesh.triangles), [("n", "u1"), ("i", "<i4", 3)])
    faces["n"], faces["i"] = 3, mesh.triangles
    with open(path, "wb") as file:
        file.write(header.encode())
        file.write(np.hstack(columns).astype("<f4").tobytes())
        file.write(faces.tobytes())


def shape_of(glb, mesh, name, textures, folder, plain):
    values = material_values(glb, mesh.material)
    flat = mesh.normals is None
    path = os.path.join(folder, name + ".ply")
    write_ply(path, mesh)
    shape = {"type": "ply", "filename": path, "face_normals": flat, "bsdf": bsdf_of(values, flat or plain, textures)}
    if np.any(values["emission"] > 0):
        if values["double_sided"]:
            sys.exit("double-sided lamps are not read")
        shape["emitter"] = {"type": "area", "radiance": {"type": "rgb",
                                                         "value": [float(x) for x in values["emission"]]}}
    return shape


def emitter_of(light):
    rgb = {"type": "rgb", "value": [float(c) for c in light.color]}
    if light.kind == "directional":
        return {"type": "directional", "direction": light.axis.tolist(), "irradiance": rgb}
    if light.kind == "point":
        return {"type": "point", "position": light.position.tolist(), "intensity": rgb}
    return {"type": "gltf_spot", "position": mi.ScalarPoint3f(light.position.tolist()),
            "axis": mi.ScalarVector3f(light.axis.tolist()), "r": float(light.color[0]), "g": float(light.color[1]),
            "b": float(light.color[2]), "inner": light.inner, "outer": light.outer}


def sensor_of(camera, size):
    turned = camera.world @ np.diag([-1.0, 1.0, -1.0, 1.0])  # Mitsuba looks along +z, x to the left
    return {"type": "perspective", "fov_axis": "y", "fov": float(np.degrees(camera.yfov)),
            "near_clip": 1e-3, "far_clip": 1e5, "to_world": mi.ScalarTransform4f(turned.tolist()),
            "sampler": {"type": "independent"},
            "film": {"type": "hdrfilm", "width": size, "height": size, "pixel_format": "rgb",
                     "component_format": "float32", "rfilter": {"type": "box"}}}


def scene_dict(path, folder, plain=False):
    """Surfaces and lights, for mi.load_dict; their files lie in `folder`. `plain` uses Mitsuba's own `diffuse` for
    Lambertian surfaces with interpolated normals too, which lets some light through below the horizon."""
    glb = gltf.Glb(path)
    meshes, lights, _ = gltf.scene_of(glb)
    textures = load_textures(glb, folder)
    scene = {"type": "scene"}
    for i, mesh in enumerate(meshes):
        scene[f"mesh{i}"] = shape_of(glb, mesh, f"mesh{i}", textures, folder, plain)
    for i, light in enumerate(lights):
        scene[f"light{i}"] = emitter_of(light)
    return scene
