"""Pictures of the other renderers as EXR files with the layer `indirect`, which `rcsplat compare` reads."""

import json
import pathlib
import subprocess

import numpy as np

LAYER = ["--chnames", "indirect.R,indirect.G,indirect.B", "-d", "float", "-o"]


def write_indirect(path, pixels):
    """`pixels` is an array (height, width, 3), row 0 at the top."""
    pfm = pathlib.Path(path).with_suffix(".pfm")
    height, width = pixels.shape[:2]
    pfm.write_bytes(b"PF\n%d %d\n-1.0\n" % (width, height) + np.ascontiguousarray(pixels[::-1], "<f4").tobytes())
    subprocess.run(["oiiotool", pfm, *LAYER, path], check=True)
    pfm.unlink()


def write_difference(path, image, direct):
    """The indirect light of picture file `image`: what it has more than `direct`."""
    subprocess.run(["oiiotool", image, "--ch", "R,G,B", direct, "--ch", "R,G,B", "--sub", *LAYER, path], check=True)


def indirect_error(rcsplat, image, reference):
    """What `rcsplat compare` says of the layer `indirect`, as a dictionary."""
    result = subprocess.run([rcsplat, "compare", image, reference, "--layer", "indirect", "--json"], check=True,
                            stdout=subprocess.PIPE)
    return json.loads(result.stdout)
