"""No thread of the add-on's own calls Blender: what runs in one is found in the source, and knows no bpy."""

import ast
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2] / "service/blender/rcsplat_render"
BLENDER = {"bpy", "gpu", "gpu_extras", "mathutils", "bl_math"}


def imported(tree):
    """(what stands for Blender, the add-on's own modules) by the names that a module uses for them."""
    blender, own = set(), {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            blender |= {a.asname or a.name.split(".")[0] for a in node.names if a.name.split(".")[0] in BLENDER}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and (node.module or "").split(".")[0] in BLENDER:
            blender |= {a.asname or a.name for a in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 1:
            own.update({a.asname or a.name: node.module or a.name for a in node.names})
    return blender, own


def knows_blender(module, trees, seen=()):
    """Whether it, or what it imports of the add-on, imports Blender."""
    if module in seen or module not in trees:
        return False
    blender, own = imported(trees[module])
    return bool(blender) or any(knows_blender(name, trees, (*seen, module)) for name in own.values())


def faults_of(trees):
    faults = []
    for module, tree in trees.items():
        blender, own = imported(tree)
        text = ast.unparse(tree)
        if ("threading.Thread(" in text or "run_in_executor" in text) and knows_blender(module, trees):
            faults.append(f"{module} starts threads, and knows Blender")
        local = {n.name: n for n in tree.body if isinstance(n, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef))}
        for work in (n for n in ast.walk(tree) if isinstance(n, ast.AsyncFunctionDef)):
            reached, ahead = set(), [work]
            while ahead:
                for name in {n.id for n in ast.walk(ahead.pop()) if isinstance(n, ast.Name)} - reached:
                    reached.add(name)
                    ahead += [local[name]] if name in local else []
            faults += [f"{module}.{work.name}() runs in the link's thread, and reaches {name} of Blender"
                       for name in sorted(reached & blender)]
    return faults


def main():
    trees = {path.stem: ast.parse(path.read_text()) for path in ROOT.glob("*.py")}
    assert "link" in trees and any(isinstance(n, ast.AsyncFunctionDef) for n in ast.walk(trees["night"]))
    wrong = ast.parse("import bpy\ndef inner():\n    bpy.ops.x()\nasync def outer():\n    inner()\n")
    assert faults_of({"wrong": wrong}), "the test finds nothing"
    faults = faults_of(trees)
    print("\n".join(faults) or "held")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
