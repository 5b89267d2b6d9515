"""A Lambertian copy of a glTF file, so that every renderer can be given the same transport: each material keeps one
diffuse colour, the linear mean of its texture times its factor; lamps reflect nothing; nothing is transparent."""

import pathlib
import subprocess
import tempfile

import numpy as np

import gltf


def srgb_to_linear(values):
    values = np.asarray(values, float)
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def read_ppm(data):
    """Array (height, width, 3) of bytes, from a binary 8-bit PPM."""
    magic, width, height, rest = data.split(maxsplit=3)  # no more: pixels may look like white space
    if magic != b"P6" or rest[:3] != b"255":
        raise ValueError("not a binary 8-bit PPM")
    return np.frombuffer(rest[4:], np.uint8).reshape(int(height), int(width), 3)


def mean_color(image_file):
    """Linear mean of an sRGB picture; oiiotool decodes it."""
    with tempfile.TemporaryDirectory() as folder:
        ppm = pathlib.Path(folder) / "image.ppm"
        subprocess.run(["oiiotool", image_file, "--ch", "R,G,B", "-d", "uint8", "-o", ppm], check=True,
                       stdout=subprocess.DEVNULL)
        pixels = read_ppm(ppm.read_bytes())
    return srgb_to_linear(np.arange(256) / 255)[pixels].mean(axis=(0, 1))


def texture_means(glb):
    means = []
    for texture in glb["textures"]:
        image = glb["images"][texture["source"]]
        with tempfile.NamedTemporaryFile(suffix="." + image["mimeType"].split("/")[1]) as file:
            file.write(glb.view(image["bufferView"])[0])
            file.flush()
            means.append(mean_color(file.name))
    return means


def lambertian_material(material, means):
    """The glTF material to use instead; `means` holds the mean colour of each texture."""
    pbr = material.get("pbrMetallicRoughness", {})
    color = gltf.base_color(material)
    if "baseColorTexture" in pbr:
        color = color * means[pbr["baseColorTexture"]["index"]]
    lamp = bool(np.any(gltf.emission(material) > 0))
    result = {"name": material.get("name", ""), "doubleSided": material.get("doubleSided", False) or not lamp,
              "pbrMetallicRoughness": {"baseColorFactor": [*([0.0] * 3 if lamp else color.tolist()), 1.0],
                                       "metallicFactor": 0.0, "roughnessFactor": 1.0},
              "extensions": {"KHR_materials_specular": {"specularFactor": 0.0}}}
    if lamp:
        result["emissiveFactor"] = material["emissiveFactor"]
        result["extensions"] |= {key: value for key, value in material.get("extensions", {}).items()
                                 if key == "KHR_materials_emissive_strength"}
    return result


def write_lambertian(source, target):
    glb = gltf.Glb(source)
    means = texture_means(glb)
    document = dict(glb.json)
    document["materials"] = [lambertian_material(m, means) for m in glb["materials"]]
    for unused in ("textures", "images", "samplers", "animations"):
        document.pop(unused, None)
    document["extensionsUsed"] = sorted({*glb["extensionsUsed"], "KHR_materials_specular"})
    gltf.write_glb(target, document, glb.buffer)
