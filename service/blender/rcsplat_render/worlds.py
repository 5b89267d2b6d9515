"""Blender's world as the light around a scene: a colour, or a latitude-longitude image that may be turned."""

from __future__ import annotations

import hashlib
import math
import pathlib
from typing import Any, List, NamedTuple, Tuple, Union

import numpy

from .pictures import write_exr

Radiance = Tuple[float, float, float]


class World(NamedTuple):
    """What submit() takes."""

    environment: Union[Radiance, pathlib.Path]
    rotation: float  # [degrees]
    warnings: List[str]


def _background(world: Any) -> Any:
    for node in world.node_tree.nodes:
        if node.bl_idname == "ShaderNodeOutputWorld" and node.is_active_output and node.inputs["Surface"].links:
            found = node.inputs["Surface"].links[0].from_node
            return found if found.bl_idname == "ShaderNodeBackground" else None
    return None


def _turn(texture: Any, name: str, warnings: List[str]) -> float:
    """About the vertical [degrees]. The middle of Blender's images shows +X, that of the server's +Y of Blender."""
    links = texture.inputs["Vector"].links
    if not links:
        return -90.0
    node = links[0].from_node
    if node.bl_idname == "ShaderNodeTexCoord":
        return -90.0
    if node.bl_idname != "ShaderNodeMapping" or node.inputs["Rotation"].is_linked:
        warnings.append(f"world '{name}': its image is turned by {node.name}, which is left out")
        return -90.0
    x, y, z = (float(angle) for angle in node.inputs["Rotation"].default_value)
    moved = any(abs(v) > 1e-6 for v in node.inputs["Location"].default_value) or any(
        abs(v - 1.0) > 1e-6 for v in node.inputs["Scale"].default_value) if "Location" in node.inputs else False
    if abs(x) > 1e-6 or abs(y) > 1e-6 or moved:
        warnings.append(f"world '{name}': of its mapping the rotation about Z alone is taken")
    turned = math.degrees(z) * (1.0 if node.vector_type == "TEXTURE" else -1.0)
    return (turned - 90.0 + 180.0) % 360.0 - 180.0


def _linear(values: Any) -> Any:
    """Of sRGB's curve."""
    return numpy.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def _image_file(image: Any, scale: float, folder: pathlib.Path) -> pathlib.Path:
    """The image times the scale as an EXR, named by its content."""
    width, height = image.size
    values = numpy.empty(width * height * image.channels, dtype=numpy.float32)
    image.pixels.foreach_get(values)
    pixels = values.reshape(height, width, image.channels)[::-1]
    rgb = pixels[..., :3] if image.channels >= 3 else numpy.repeat(pixels[..., :1], 3, axis=2)
    if not image.is_float and image.colorspace_settings.name == "sRGB":
        rgb = _linear(rgb)
    rgb = numpy.ascontiguousarray(numpy.maximum(rgb * scale, 0.0), dtype=numpy.float32)
    path = folder / f"world-{hashlib.sha256(rgb.tobytes() + bytes(str(rgb.shape), 'ascii')).hexdigest()[:16]}.exr"
    if not path.exists():
        write_exr(path, rgb)
    return path


def world_of(scene: Any, folder: pathlib.Path) -> World:
    """@param folder  for an image of the world"""
    world, warnings = scene.world, []
    if world is None:
        return World((0.0, 0.0, 0.0), 0.0, [])
    if not world.use_nodes or world.node_tree is None:
        red, green, blue = (float(value) for value in world.color[:3])
        return World((red, green, blue), 0.0, [])
    node = _background(world)
    if node is None:
        warnings.append(f"world '{world.name}': its nodes are no background, and left out; it is black")
        return World((0.0, 0.0, 0.0), 0.0, warnings)
    strength = float(node.inputs["Strength"].default_value)
    if node.inputs["Strength"].is_linked:
        warnings.append(f"world '{world.name}': its strength's nodes are left out, {strength:g} is taken")
    links = node.inputs["Color"].links
    source = links[0].from_node if links else None
    if source is not None and source.bl_idname == "ShaderNodeTexEnvironment" and source.image is not None:
        if source.projection == "EQUIRECTANGULAR" and source.image.size[0] > 0:
            rotation = _turn(source, world.name, warnings)
            return World(_image_file(source.image, strength, folder), rotation, warnings)
        warnings.append(f"world '{world.name}': its image is missing or no latitude-longitude one; it is black")
        return World((0.0, 0.0, 0.0), 0.0, warnings)
    if source is not None:
        warnings.append(f"world '{world.name}': {source.name} is left out, the socket's colour is taken")
    red, green, blue = (strength * float(value) for value in node.inputs["Color"].default_value[:3])
    return World((red, green, blue), 0.0, warnings)
