"""What Blender's exporter makes of node trees that are no principled shader: put right where there is a near value, and
named in a warning in any case."""

from __future__ import annotations

from typing import Any, Dict, List, Optional, Tuple

EXPORTED = ("ShaderNodeBsdfPrincipled",)


def _surface(material: Any) -> Optional[Any]:
    """The node that shades it."""
    for node in material.node_tree.nodes:
        if node.bl_idname == "ShaderNodeOutputMaterial" and node.is_active_output:
            links = node.inputs["Surface"].links
            return links[0].from_node if links else None
    return None


def _value(node: Any, socket: str, default: float) -> float:
    found = node.inputs.get(socket)
    return float(found.default_value) if found is not None else default


def _color(node: Any) -> List[float]:
    return [float(value) for value in node.inputs["Color"].default_value[:3]]


def _linked(node: Any) -> bool:
    return any(socket.is_linked for socket in node.inputs if socket.name not in ("Normal", "Tangent"))


def _diffuse(node: Any, entry: Dict[str, Any]) -> None:
    entry["pbrMetallicRoughness"] = {"baseColorFactor": [*_color(node), 1.0], "metallicFactor": 0.0}
    entry.setdefault("extensions", {})["KHR_materials_specular"] = {"specularFactor": 0.0}


def _emission(node: Any, entry: Dict[str, Any]) -> None:
    strength = [_value(node, "Strength", 1.0) * value for value in _color(node)]
    most = max(strength)
    entry["pbrMetallicRoughness"] = {"baseColorFactor": [0.0, 0.0, 0.0, 1.0], "metallicFactor": 0.0}
    entry["emissiveFactor"] = [value / most if most > 0.0 else 0.0 for value in strength]
    entry["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": most},
                           "KHR_materials_specular": {"specularFactor": 0.0}}


def _glossy(node: Any, entry: Dict[str, Any]) -> None:
    entry["pbrMetallicRoughness"] = {"baseColorFactor": [*_color(node), 1.0], "metallicFactor": 1.0,
                                     "roughnessFactor": _value(node, "Roughness", 0.5)}


def _glass(node: Any, entry: Dict[str, Any]) -> None:
    entry["pbrMetallicRoughness"] = {"baseColorFactor": [*_color(node), 1.0], "metallicFactor": 0.0,
                                     "roughnessFactor": _value(node, "Roughness", 0.0)}
    entry["extensions"] = {"KHR_materials_transmission": {"transmissionFactor": 1.0},
                           "KHR_materials_ior": {"ior": _value(node, "IOR", 1.45)}}


def _principled(node: Any, entry: Dict[str, Any]) -> None:
    """Its own values, by Blender 3's names and later ones; links are not followed."""
    def value(names: Tuple[str, ...], default: float) -> float:
        return next((_value(node, name, default) for name in names if name in node.inputs), default)

    def color(*names: str) -> List[float]:
        socket = next(node.inputs[name] for name in names if name in node.inputs)
        return [float(c) for c in socket.default_value[:3]]

    alpha = value(("Alpha",), 1.0)
    entry["pbrMetallicRoughness"] = {"baseColorFactor": [*color("Base Color"), alpha],
                                     "metallicFactor": value(("Metallic",), 0.0),
                                     "roughnessFactor": value(("Roughness",), 0.5)}
    extensions = entry.setdefault("extensions", {})
    extensions["KHR_materials_ior"] = {"ior": max(1.0, value(("IOR",), 1.45))}
    for word, key, sockets in (("transmission", "transmissionFactor", ("Transmission", "Transmission Weight")),
                               ("clearcoat", "clearcoatFactor", ("Clearcoat", "Coat Weight"))):
        if value(sockets, 0.0) > 0.0:
            extensions[f"KHR_materials_{word}"] = {key: value(sockets, 0.0)}
    if alpha < 1.0:
        entry["alphaMode"] = "BLEND"
    glow = [c * value(("Emission Strength",), 1.0) for c in color("Emission", "Emission Color")]
    if max(glow) > 0.0:
        entry["emissiveFactor"] = [c / max(glow) for c in glow]
        extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": max(glow)}


def _no_reflection(node: Any, entry: Dict[str, Any]) -> None:
    """Where the shader's is 0, older exporters leave what glTF's still has at grazing angles."""
    socket = node.inputs.get("Specular") or node.inputs.get("Specular IOR Level")
    if socket is not None and not socket.is_linked and socket.default_value == 0.0:
        entry.setdefault("extensions", {})["KHR_materials_specular"] = {"specularFactor": 0.0}


def entry_of(material: Any) -> Dict[str, Any]:
    """A glTF material near to Blender's, by the values of its shader alone."""
    entry: Dict[str, Any] = {"name": material.name, "doubleSided": True}
    node = _surface(material) if material.use_nodes and material.node_tree is not None else None
    if node is not None and node.bl_idname in EXPORTED:
        _principled(node, entry)
    elif node is not None and node.bl_idname in NEAREST:
        NEAREST[node.bl_idname][0](node, entry)
    else:
        entry["pbrMetallicRoughness"] = {"baseColorFactor": [*(float(c) for c in material.diffuse_color[:3]), 1.0],
                                         "metallicFactor": 0.0}
    return entry


# By the shader: what it becomes, and what is said of that; nothing where they are the same.
NEAREST = {
    "ShaderNodeBsdfDiffuse": (_diffuse, ""),
    "ShaderNodeEmission": (_emission, ""),
    "ShaderNodeBsdfGlossy": (_glossy, "is a rough metal"),
    "ShaderNodeBsdfAnisotropic": (_glossy, "is a rough metal"),
    "ShaderNodeBsdfGlass": (_glass, "lets light through as a thin sheet would"),
    "ShaderNodeBsdfRefraction": (_glass, "lets light through as a thin sheet would"),
}


def put_right(document: Dict[str, Any], materials: Any) -> List[str]:
    """Warnings of what was not. @param materials  Blender's, by name"""
    warnings: List[str] = []
    for entry in document.get("materials", []):
        material = materials.get(entry.get("name", ""))
        if material is None or not material.use_nodes or material.node_tree is None:
            continue
        node, name = _surface(material), material.name
        if node is None:
            continue
        if node.bl_idname in EXPORTED:
            _no_reflection(node, entry)
            continue
        found = NEAREST.get(node.bl_idname)
        if found is None:
            warnings.append(f"material '{name}': {node.name} is not known; Blender's glTF exporter chose what is seen")
            continue
        change, said = found
        change(node, entry)
        if said:
            warnings.append(f"material '{name}': {node.name} {said}")
        if _linked(node):
            warnings.append(f"material '{name}': nodes before {node.name} are left out, its own values are taken")
    used = {name for entry in document.get("materials", []) for name in entry.get("extensions", {})}
    document["extensionsUsed"] = sorted(used.union(document.get("extensionsUsed", [])))
    if not document["extensionsUsed"]:
        del document["extensionsUsed"]
    return warnings
