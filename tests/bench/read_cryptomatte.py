#!/usr/bin/env python3
"""Reads the Cryptomatte layers of an EXR file by the published specification (1.2), with none of our code.

  read_cryptomatte.py PICTURE.exr [--png IDS.png]

Needs `pip install openexr numpy mmh3` (and pillow for --png). Checks: the header's four entries; that each name's id is
its MurmurHash3_32, made finite; that each id in the picture is in the manifest; that parts come in order and, where$
fewer than all ranks are taken, add up to alpha.
"""

import argparse
import json
import sys

import mmh3
import numpy
import OpenEXR

WITHIN = 1e-3  # of alpha, which a file of half floats rounds


def id_of(name):
    """The specification's: all exponent bits equal would be no finite number."""
    bits = mmh3.hash(name, 0, signed=False)
    return bits ^ (1 << 23) if bits >> 23 & 255 in (0, 255) else bits


def mattes(header):
    """{layer: its entries of the header}."""
    found = {}
    for key, value in header.items():
        if key.startswith("cryptomatte/"):
            _, digits, entry = key.split("/")
            found.setdefault(digits, {})[entry] = value
    return {entries["name"]: dict(entries, key=digits) for digits, entries in found.items()}


def ranks_of(channels, layer):
    """Ids (as bits) and parts, [rank, y, x], from layer00.R, .G, .B, .A, layer01.R, ..."""
    ids, parts = [], []
    for number in range(100):
        if f"{layer}{number:02}.R" not in channels:
            break
        for letters in ("RG", "BA"):
            pair = [channels[f"{layer}{number:02}.{letter}"].pixels for letter in letters]
            assert all(p.dtype == numpy.float32 for p in pair), layer + " is not stored as 32-bit floats"
            ids.append(numpy.ascontiguousarray(pair[0]).view(numpy.uint32))
            parts.append(pair[1])
    return numpy.array(ids), numpy.array(parts)


def check(layer, entries, channels):
    assert entries["hash"] == "MurmurHash3_32" and entries["conversion"] == "uint32_to_float32", entries
    assert entries["key"] == f"{id_of(layer):08x}"[:7], entries["key"]
    manifest = {name: int(digits, 16) for name, digits in json.loads(entries["manifest"]).items()}
    assert all(id_of(name) == number for name, number in manifest.items()), "an id is not its name's hash"
    ids, parts = ranks_of(channels, layer)
    taken = parts > 0
    assert numpy.isfinite(ids.view(numpy.float32)).all() and not ids[~taken].any()
    assert set(numpy.unique(ids[taken])) <= set(manifest.values()), "an id is not in the manifest"
    assert (numpy.diff(parts, axis=0) <= 0).all(), "parts are not in order"
    suffice = ~taken[-1]
    alpha = channels["A"].pixels
    off = numpy.abs(parts.sum(axis=0) - alpha)[suffice].max(initial=0.0)
    assert off <= WITHIN, f"parts add up to alpha but for {off}"
    seen = sorted(name for name, number in manifest.items() if number in ids[taken])
    print(f"{layer}: {len(manifest)} names, {len(seen)} seen, at most {taken.sum(axis=0).max()} in a pixel; parts add "
          f"up to alpha but for {off:.1e}; ranks suffice in {100 * suffice.mean():.2f} % of the pixels")
    return ids, parts


def false_colours(ids, parts):
    """Each id in a colour of its own, in its parts."""
    picture = numpy.zeros(ids.shape[1:] + (3,))
    for number, part in zip(ids, parts):
        colours = numpy.stack([(number >> shift & 255) / 255.0 for shift in (0, 8, 16)], axis=-1)
        picture += part[..., None] * colours
    return (255.0 * picture.clip(0.0, 1.0)).astype(numpy.uint8)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("exr")
    parser.add_argument("--png", help="write each layer's ids as colours, side by side")
    arguments = parser.parse_args()
    with OpenEXR.File(arguments.exr, separate_channels=True) as file:
        channels, header = file.channels(), file.header()
        found = mattes(header)
        if not found:
            sys.exit(arguments.exr + " has no Cryptomatte")
        read = [check(layer, entries, channels) for layer, entries in sorted(found.items())]
        if arguments.png:
            from PIL import Image
            Image.fromarray(numpy.hstack([false_colours(*layer) for layer in read])).save(arguments.png)


if __name__ == "__main__":
    main()
