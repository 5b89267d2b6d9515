import pathlib
import tempfile
import unittest

try:
    import numpy as np
except ImportError:
    raise unittest.SkipTest("needs numpy")

import gltf
import lambertian


def accessor(document, buffer, values, component):
    data = values.astype(gltf.COMPONENTS[component]).tobytes()
    document["bufferViews"].append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(data)})
    document["accessors"].append({"bufferView": len(document["bufferViews"]) - 1, "componentType": component,
                                  "count": len(values), "type": {1: "SCALAR", 3: "VEC3"}[values.shape[1]]})
    return len(document["accessors"]) - 1, buffer + data


def write_triangle(path, normals, node, material=None, lights=()):
    """One triangle in the plane z = 0, front towards +z, below a parent moved by (10, 0, 0)."""
    document = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": []}
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    position, buffer = accessor(document, b"", corners, 5126)
    normal, buffer = accessor(document, buffer, np.array(normals, float), 5126)
    index, buffer = accessor(document, buffer, np.array([[0], [1], [2]]), 5125)
    document |= {"scenes": [{"nodes": [0, 2]}], "nodes": [
        {"translation": [10, 0, 0], "children": [1]}, {"mesh": 0, **node},
        {"name": "eye", "camera": 0, "translation": [1, 2, 3]}, *({"extensions": {"KHR_lights_punctual": {"light": i}}}
                                                                  for i in range(len(lights)))],
        "meshes": [{"primitives": [{"attributes": {"POSITION": position, "NORMAL": normal}, "indices": index,
                                    "material": 0}]}],
        "materials": [material or {}], "cameras": [{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}],
        "extensions": {"KHR_lights_punctual": {"lights": list(lights)}}}
    document["scenes"][0]["nodes"] += range(3, 3 + len(lights))
    gltf.write_glb(path, document, buffer)


class Scene(unittest.TestCase):
    FLAT = [[0, 0, 1]] * 3

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name, "scene.glb")

    def read(self, *args, **more):
        write_triangle(self.path, *args, **more)
        return gltf.scene_of(gltf.Glb(self.path))

    def test_puts_triangles_into_world_space_through_all_parents(self):
        quarter_turn = [0, 0, np.sqrt(0.5), np.sqrt(0.5)]  # about z: x to y, y to -x
        meshes, _, _ = self.read(self.FLAT, {"rotation": quarter_turn, "scale": [2, 1, 1]})
        np.testing.assert_allclose(meshes[0].positions, [[10, 0, 0], [10, 2, 0], [9, 0, 0]], atol=1e-6)

    def test_knows_flat_normals_from_smooth_ones(self):
        self.assertIsNone(self.read(self.FLAT, {})[0][0].normals)
        bent = [[0, 0, 1], [0.6, 0, 0.8], [0, 0, 1]]
        np.testing.assert_allclose(self.read(bent, {})[0][0].normals, bent, atol=1e-6)

    def test_keeps_fronts_when_a_node_mirrors(self):
        mesh = self.read(self.FLAT, {"scale": [-1, 1, 1]})[0][0]
        np.testing.assert_allclose(gltf.face_normals(mesh.positions, mesh.triangles), [[0, 0, 1]], atol=1e-6)

    def test_reads_lights_with_intensity_in_their_color(self):
        _, lights, _ = self.read(self.FLAT, {}, lights=[{"type": "directional", "color": [1, 0.5, 0], "intensity": 4}])
        np.testing.assert_allclose(lights[0].color, [4, 2, 0])
        np.testing.assert_allclose(lights[0].axis, [0, 0, -1])

    def test_finds_cameras_by_name_and_names_them_when_it_cannot(self):
        cameras = self.read(self.FLAT, {})[2]
        np.testing.assert_allclose(gltf.find_camera(cameras, "eye", "f").eye, [1, 2, 3])
        with self.assertRaisesRegex(SystemExit, "no camera 'ear', it has eye"):
            gltf.find_camera(cameras, "ear", "f")

    def test_refuses_a_file_that_is_not_binary_gltf(self):
        self.path.write_bytes(b"{}")
        with self.assertRaisesRegex(SystemExit, "not a binary glTF file"):
            gltf.Glb(self.path)

    def test_made_lambertian_has_neither_gloss_nor_metal_and_keeps_its_color(self):
        shiny = {"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.6, 0.5], "metallicFactor": 1.0},
                 "alphaMode": "BLEND"}
        write_triangle(self.path, self.FLAT, {}, shiny)
        lambertian.write_lambertian(self.path, self.path)
        material = gltf.Glb(self.path)["materials"][0]
        self.assertEqual(material["pbrMetallicRoughness"]["baseColorFactor"], [0.2, 0.4, 0.6, 1.0])
        self.assertEqual(material["pbrMetallicRoughness"]["metallicFactor"], 0.0)
        self.assertEqual(material["extensions"]["KHR_materials_specular"]["specularFactor"], 0.0)
        self.assertNotIn("alphaMode", material)
        self.assertTrue(material["doubleSided"])


class LambertianMaterial(unittest.TestCase):
    def test_takes_the_mean_of_the_texture_times_the_factor(self):
        textured = {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 1, 1, 1], "baseColorTexture": {"index": 1}}}
        made = lambertian.lambertian_material(textured, [None, np.array([0.4, 0.3, 0.2])])
        np.testing.assert_allclose(made["pbrMetallicRoughness"]["baseColorFactor"], [0.2, 0.3, 0.2, 1.0])

    def test_of_a_lamp_reflects_nothing_and_shines_on_its_front(self):
        strength = {"KHR_materials_emissive_strength": {"emissiveStrength": 5.0}}
        made = lambertian.lambertian_material({"emissiveFactor": [1, 1, 0], "extensions": strength}, [])
        self.assertEqual(made["pbrMetallicRoughness"]["baseColorFactor"], [0, 0, 0, 1])
        np.testing.assert_allclose(gltf.emission(made), [5, 5, 0])
        self.assertFalse(made["doubleSided"])


class Pictures(unittest.TestCase):
    def test_ppm_pixels_that_look_like_white_space_are_kept(self):
        pixels = np.full((1, 2, 3), 10, np.uint8)
        np.testing.assert_array_equal(lambertian.read_ppm(b"P6\n2 1\n255\n" + pixels.tobytes()), pixels)

    def test_srgb_is_linear_at_both_ends_and_follows_its_power_between(self):
        np.testing.assert_allclose(lambertian.srgb_to_linear([0, 1, 0.5]), [0, 1, 0.21404], atol=1e-5)


if __name__ == "__main__":
    unittest.main()
