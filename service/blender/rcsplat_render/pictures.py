"""EXR files of the server as arrays, and as the passes that Blender knows."""

from __future__ import annotations

import contextlib
import importlib
import pathlib
import sys
import tempfile
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Tuple

import bpy
import numpy

from . import exr_file

FAR = 1e10  # Blender's depth where nothing is seen
LEAST_ALBEDO = 1e-3


class Pass(NamedTuple):
    """One that Blender keeps of a picture, and what of the server's it is made of."""

    name: str
    channels: str
    kind: str  # of Blender's register_pass()
    switch: str  # of the view layer
    layers: Tuple[str, ...]


PASSES = (
    Pass("Depth", "Z", "VALUE", "use_pass_z", ("depth",)),
    Pass("Normal", "XYZ", "VECTOR", "use_pass_normal", ("normal",)),
    Pass("DiffDir", "RGB", "COLOR", "use_pass_diffuse_direct", ("direct", "albedo")),
    Pass("DiffInd", "RGB", "COLOR", "use_pass_diffuse_indirect", ("indirect", "albedo")),
    Pass("DiffCol", "RGB", "COLOR", "use_pass_diffuse_color", ("albedo",)),
    Pass("Emit", "RGB", "COLOR", "use_pass_emit", ("emission",)),
)
CRYPTOMATTES = (("CryptoObject", "use_pass_cryptomatte_object"), ("CryptoMaterial", "use_pass_cryptomatte_material"))


def passes_of(view_layer: Any) -> List[Pass]:
    """Those that are switched on."""
    found = [entry for entry in PASSES if getattr(view_layer, entry.switch, False)]
    for name, switch in CRYPTOMATTES:
        if getattr(view_layer, switch, False):
            found += [Pass(f"{name}{i:02}", "RGBA", "COLOR", switch, (name,)) for i in range(3)]
    return found


def layers_for(passes: List[Pass]) -> List[str]:
    """Of the server's, beside beauty; never none, which would stand for all."""
    return sorted({layer for entry in passes for layer in entry.layers}) or ["emission"]


def _openimageio() -> Any:
    """Blender's own, which Blender before 4 lacks. Blender as a Python package hides it from its interpreter."""
    version = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    hidden = pathlib.Path(bpy.utils.resource_path("LOCAL")) / "python/lib" / version / "site-packages"
    if hidden.is_dir() and str(hidden) not in sys.path:
        sys.path.append(str(hidden))
    try:
        return importlib.import_module("OpenImageIO")
    except ImportError:
        return None


class Picture:
    """Layers of an EXR, rows from the top.

    @param load  for Blenders without OpenImageIO: values of the file of that name, four a pixel, rows from the bottom
    """

    def __init__(self, data: bytes, folder: pathlib.Path, load: Callable[[str], Any]) -> None:
        self.header = exr_file.read_header(data)
        self.names = exr_file.channel_names(self.header)
        self._data, self._folder, self._load = data, folder, load
        self._all: Dict[str, Any] = {}
        library = _openimageio()
        if library is None and bpy.app.version >= (4, 0):  # which do not take files without their own names
            raise OSError("this Blender's Python lacks the module OpenImageIO, by which pictures are read")
        if library is not None:
            with self._file(data) as file:
                source = library.ImageInput.open(file.name)
                if source is None:
                    raise OSError(f"the picture cannot be read: {library.geterror()}")
                pixels, names = source.read_image("float"), source.spec().channelnames
                source.close()
            self._all = {name: pixels[..., number] for number, name in enumerate(names)}

    def layer(self, name: str, channels: str) -> Any:
        """height x width x channels."""
        prefix = f"{name}." if name else ""
        if self._all:
            return numpy.stack([self._all[prefix + c] for c in channels], axis=-1)
        # Alpha comes by itself: Blender takes colours for multiplied with it, or not.
        alone = len(channels) == 1
        wanted = {prefix + c: "Y" if alone else c.upper() for c in channels if alone or c.upper() in "RGB"}
        with self._file(exr_file.renamed(self._data, wanted)) as file:
            values = numpy.asarray(self._load(file.name), dtype=numpy.float32)
        width, height = exr_file.size_of(self.header)
        pixels = values.reshape(height, width, 4)[::-1, :, :len(wanted)]
        return pixels if len(wanted) == len(channels) else numpy.dstack([pixels, self.layer(name, channels[-1])])

    @contextlib.contextmanager
    def _file(self, data: bytes) -> Iterator[Any]:
        with tempfile.NamedTemporaryFile(suffix=".exr", dir=self._folder) as file:
            file.write(data)
            file.flush()
            yield file


def write_exr(path: pathlib.Path, rgb: Any) -> None:
    """height x width x 3 floats; appears under its name once it is complete."""
    temporary = path.with_name(f".{path.name}")
    temporary.write_bytes(exr_file.packed(rgb))
    temporary.replace(path)


def _planar(depth: Any, cosines: Any) -> Any:
    return numpy.where(numpy.isfinite(depth), depth * cosines, FAR).astype(numpy.float32)


def cosines(size: Tuple[int, int], window: Tuple[int, int, int, int], camera: Any) -> Any:
    """Between the axis and the rays through the pixels of a window (x, y from the top, width, height) of a picture."""
    x, y, width, height = window
    if camera.ymag:
        return numpy.ones((height, width))
    pixel = 2.0 * numpy.tan(0.5 * camera.yfov) / size[1]
    right = (x + numpy.arange(width) + 0.5 - 0.5 * size[0] + camera.lens_shift.right * size[1]) * pixel
    up = (y + numpy.arange(height) + 0.5 - 0.5 * size[1] - camera.lens_shift.up * size[1]) * pixel
    return 1.0 / numpy.sqrt(1.0 + right[None, :] ** 2 + up[:, None] ** 2)


def blender_pass(picture: Picture, entry: Pass, axis: Any) -> Any:
    """height x width x channels. @param axis  cosines(): Blender's depth is along the camera's axis"""
    if entry.name == "Depth":
        return _planar(picture.layer("depth", "Z"), axis[..., None])
    if entry.name == "Normal":  # Y up to Z up
        x, y, z = numpy.moveaxis(picture.layer("normal", "RGB"), -1, 0)
        return numpy.stack([x, -z, y], axis=-1)
    if entry.name.startswith("Crypto"):
        return picture.layer(entry.name, "RGBA" if f"{entry.name}.R" in picture.names else "rgba")
    if entry.name == "Emit":
        return picture.layer("emission", "RGB")
    # So that DiffCol (DiffDir + DiffInd) + Emit is Combined, also where light is reflected by what has no albedo.
    albedo = picture.layer("albedo", "RGB")
    color = numpy.where(albedo > LEAST_ALBEDO, albedo, 1.0)
    if entry.name == "DiffCol":
        return color
    return picture.layer(entry.layers[0], "RGB") / color


def plain(data: bytes) -> bytes:
    """The file with beauty alone, opaque."""
    return exr_file.renamed(data, {"B": "B", "G": "G", "R": "R"})


def combined(picture: Picture, sky: Any = None) -> Any:
    """RGBA. @param sky  radiance of a constant one that the film leaves out; none: the picture is opaque"""
    beauty = picture.layer("", "RGBA")
    if sky is None:
        beauty[..., 3] = 1.0
    else:
        beauty[..., :3] -= (1.0 - beauty[..., 3:]) * numpy.asarray(sky, dtype=numpy.float32)
    return beauty


def flat_rows(values: Any) -> Any:
    """As Blender's passes take them: rows from the bottom, one value after the other."""
    return numpy.ascontiguousarray(values[::-1], dtype=numpy.float32).reshape(-1)
