"""What Blender's exporter makes of node trees that are no principled shader: put right where there is a near value, and
named in a warning in any case."""

from __future__ import annotations

from typing import Any, Dict, List, Optional

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
        if node is None or node.bl_idname in EXPORTED:
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
