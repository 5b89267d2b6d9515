#include "rcs/fingerprint.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <vector>

#include "scene/material_fields.h"
#include "scene/scene_parts.h"
#include "util/random.h"

namespace rcs {
namespace {

/// Vectors and matrices of numbers hold no padding; their bytes are their value.
template <typename Value>
void add_plain(Fingerprint& print, const Value& value)
{
    print.add_bytes(&value, sizeof value);
}

template <typename Value>
void add_plain(Fingerprint& print, const std::vector<Value>& values)
{
    print.add(values.size());
    print.add_bytes(values.data(), values.size() * sizeof(Value));
}

void add_texture(Fingerprint& print, const Texture& texture) { print.add(texture.levels.hash()); }

// The structures are taken apart by all their members: one that gets a new member fails to compile here.

void add_slot(Fingerprint& print, const TextureSlot& slot)
{
    const auto& [texture, uv_set, wrap_u, wrap_v, nearest, texture_from_uv] = slot;
    print.add(texture);
    print.add(uv_set);
    print.add(wrap_u);
    print.add(wrap_v);
    print.add(nearest);
    add_plain(print, texture_from_uv);
}

void add_material(Fingerprint& print, const Material& material)
{
    for (const MaterialColor& color : kMaterialColors) add_plain(print, material.*color.value);
    for (const MaterialFactor& factor : kMaterialFactors) print.add(material.*factor.value);
    for (const MaterialTexture& texture : kMaterialTextures) add_slot(print, material.*texture.slot);
    print.add(material.alpha_mode);
    print.add(material.unlit);
    print.add(material.double_sided);
}

void add_mesh(Fingerprint& print, const Mesh& mesh)
{
    const auto& [name, positions, normals, uvs, uvs1, colors, tangents, triangles, material] = mesh;
    add_plain(print, positions);
    add_plain(print, normals);
    add_plain(print, uvs);
    add_plain(print, uvs1);
    add_plain(print, colors);
    add_plain(print, tangents);
    add_plain(print, triangles);
    print.add(material);
}

void add_light(Fingerprint& print, const PunctualLight& light)
{
    const auto& [name, kind, intensity, position, direction, range, inner_cone, outer_cone] = light;
    print.add(kind);
    add_plain(print, intensity);
    add_plain(print, position);
    add_plain(print, direction);
    print.add(range);
    print.add(inner_cone);
    print.add(outer_cone);
}

void add_environment(Fingerprint& print, const EnvironmentImage& environment)
{
    const auto& [name, width, height, radiance, rotation] = environment;
    print.add(width);
    print.add(height);
    add_plain(print, radiance);
    print.add(rotation);
}

void add_instances(Fingerprint& print, const std::vector<Instance>& instances)
{
    print.add(instances.size());
    for (const Instance& instance : instances) {
        print.add(instance.mesh);
        add_plain(print, instance.world_from_object);
    }
}

/// Lamps without size, and the sky.
void add_lamps(Fingerprint& print, const Scene& scene)
{
    print.add(scene.lights.size());
    for (const PunctualLight& light : scene.lights) add_light(print, light);
    add_plain(print, scene.sky_radiance);
    add_environment(print, scene.environment);
}

template <typename Value>
bool same(const Value& a, const Value& b, void (*add)(Fingerprint&, const Value&))
{
    Fingerprint of_a, of_b;
    add(of_a, a);
    add(of_b, b);
    return of_a.text() == of_b.text();
}

/// Which elements of two lists of the same length differ.
template <typename Value>
std::vector<bool> differing(const std::vector<Value>& a, const std::vector<Value>& b,
                            void (*add)(Fingerprint&, const Value&))
{
    std::vector<bool> result(b.size());
    for (std::size_t i = 0; i < result.size(); ++i) result[i] = !same(a[i], b[i], add);
    return result;
}

/// The same one by one: most that differ do so at once.
template <typename Value>
bool same_each(const std::vector<Value>& a, const std::vector<Value>& b, void (*add)(Fingerprint&, const Value&))
{
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [&](const Value& x, const Value& y) { return same(x, y, add); });
}

}  // namespace

void Fingerprint::add_bytes(const void* data, std::size_t size)
{
    const auto* bytes = static_cast<const char*>(data);
    for (std::size_t i = 0; i < size; i += sizeof(std::uint64_t)) {
        std::uint64_t word = 0;
        std::memcpy(&word, bytes + i, size - i < sizeof word ? size - i : sizeof word);
        state_ = mix64(state_ ^ word);
    }
}

void Fingerprint::add(std::string_view text)
{
    add(text.size());
    add_bytes(text.data(), text.size());
}

std::string Fingerprint::text() const
{
    char digits[17];
    std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(state_));
    return digits;
}

void add(Fingerprint& print, const Scene& scene)
{
    const auto& [name, textures, materials, meshes, instances, lights, cameras, sky_radiance, environment, origin] =
        scene;
    print.add(textures.size());
    for (const Texture& texture : textures) add_texture(print, texture);
    print.add(materials.size());
    for (const Material& material : materials) add_material(print, material);
    print.add(meshes.size());
    for (const Mesh& mesh : meshes) add_mesh(print, mesh);
    add_instances(print, instances);
    add_lamps(print, scene);
    add_plain(print, origin);
}

bool same_surfaces(const Scene& a, const Scene& b)
{
    return a.origin == b.origin && same(a.instances, b.instances, add_instances) &&
           same_each(a.meshes, b.meshes, add_mesh) && same_each(a.materials, b.materials, add_material) &&
           same_each(a.textures, b.textures, add_texture);
}

std::optional<std::vector<bool>> changed_instances(const Scene& a, const Scene& b)
{
    if (a.origin != b.origin || a.instances.size() != b.instances.size() || a.meshes.size() != b.meshes.size() ||
        a.materials.size() != b.materials.size() || a.textures.size() != b.textures.size())
        return std::nullopt;
    const std::vector<bool> textures = differing(a.textures, b.textures, add_texture);
    std::vector<bool> materials = differing(a.materials, b.materials, add_material);
    for (std::size_t m = 0; m < materials.size(); ++m)
        for (const MaterialTexture& texture : kMaterialTextures)
            if (const TextureSlot& slot = b.materials[m].*texture.slot; slot.used())
                materials[m] = materials[m] || textures[static_cast<std::size_t>(slot.texture)];
    std::vector<bool> meshes = differing(a.meshes, b.meshes, add_mesh);
    for (std::size_t m = 0; m < meshes.size(); ++m)
        meshes[m] = meshes[m] || materials[static_cast<std::size_t>(b.meshes[m].material)];
    std::vector<bool> changed(b.instances.size());
    for (std::size_t i = 0; i < changed.size(); ++i)
        changed[i] = a.instances[i].mesh != b.instances[i].mesh ||
                     a.instances[i].world_from_object != b.instances[i].world_from_object ||
                     meshes[static_cast<std::size_t>(b.instances[i].mesh)];
    return changed;
}

bool same_lamps(const Scene& a, const Scene& b) { return same(a, b, add_lamps); }

void add(Fingerprint& print, const Camera& camera)
{
    const auto& [name, projection, world_from_view, yfov, ymag, lens_shift] = camera;
    print.add(projection);
    add_plain(print, world_from_view);
    print.add(yfov);
    print.add(ymag);
    add_plain(print, lens_shift);
}

}  // namespace rcs
