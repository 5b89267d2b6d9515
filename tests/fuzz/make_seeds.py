#!/usr/bin/env python3
"""Makes seed corpora for the fuzzers from the test corpus and the shared scenes: OUT/gltf, OUT/draco, OUT/image and
OUT/records.

    make_seeds.py CORPUS_FOLDER [SCENES_FOLDER] --out OUT     # CORPUS_FOLDER as write_corpus makes it
"""

import argparse
import hashlib
import json
import pathlib
import struct

LARGEST = 120_000  # [bytes]


def parts(data):
    if data[:4] != b"glTF" or len(data) < 20:
        return None
    length, = struct.unpack_from("<I", data, 12)
    try:
        document = json.loads(data[20:20 + length])
    except (ValueError, RecursionError):
        return None
    return (document, data[20 + length + 8:]) if isinstance(document, dict) else None


def view_bytes(document, binary, index):
    try:
        view = document["bufferViews"][index]
        begin = view.get("byteOffset", 0)
        return binary[begin:begin + view["byteLength"]]
    except (KeyError, IndexError, TypeError):
        return b""


def dicts(value):
    """All objects of a document."""
    if isinstance(value, dict):
        yield value
        value = list(value.values())
    if isinstance(value, list):
        for inner in value:
            yield from dicts(inner)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=pathlib.Path)
    parser.add_argument("--out", required=True, type=pathlib.Path)
    arguments = parser.parse_args()
    counts = {"gltf": 0, "draco": 0, "image": 0, "records": 0}

    def put(kind, data):
        if not 0 < len(data) <= LARGEST:
            return
        folder = arguments.out / kind
        folder.mkdir(parents=True, exist_ok=True)
        (folder / hashlib.sha1(data).hexdigest()).write_bytes(data)
        counts[kind] += 1

    for top in arguments.folders:
        for path in sorted(top.rglob("*")):
            if not path.is_file():
                continue
            data = path.read_bytes()
            if path.suffix in (".png", ".jpg", ".webp", ".exr", ".hdr"):
                put("image", data)
            if path.suffix == ".records":
                put("records", data)
            if path.suffix not in (".glb", ".gltf"):
                continue
            put("gltf", data)
            found = parts(data)
            if not found:
                continue
            document, binary = found
            images = document.get("images")
            for image in images if isinstance(images, list) else []:
                if isinstance(image, dict) and isinstance(image.get("bufferView"), int):
                    put("image", view_bytes(document, binary, image["bufferView"]))
            for element in dicts(document):
                draco = element.get("KHR_draco_mesh_compression")
                if isinstance(draco, dict) and isinstance(draco.get("bufferView"), int):
                    # The first two bytes are how many vertices and triangles the file promises, less 1.
                    put("draco", b"\x03\x01" + view_bytes(document, binary, draco["bufferView"]))
    print(", ".join("%d %s" % (count, kind) for kind, count in counts.items()))


if __name__ == "__main__":
    main()
