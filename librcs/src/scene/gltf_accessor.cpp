#include "scene/gltf_accessor.h"

#include <algorithm>
#include <cstring>
#include <limits>

namespace rcs {
namespace {

/// `count` elements of equal layout somewhere in a buffer view; checked to lie inside it.
struct Elements {
    const std::uint8_t* data = nullptr;
    std::size_t count = 0;
    std::size_t stride = 0;
};

/// What a message about one accessor says.
struct Place {
    const GltfFile& file;
    std::string name;

    [[noreturn]] void fail(const std::string& what) const { bad_file(file, name + " " + what); }
};

std::size_t component_size(const Place& place, int component_type)
{
    switch (component_type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return 1;
        case TINYGLTF_COMPONENT_TYPE_SHORT:
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return 2;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        case TINYGLTF_COMPONENT_TYPE_FLOAT:
            return 4;
        default:
            place.fail("has component type " + std::to_string(component_type) + ", which glTF does not have");
    }
}

Elements elements_in(const Place& place, const tinygltf::Model& model, int view, std::size_t offset, std::size_t count,
                     std::size_t element_size)
{
    if (count == 0) return {};
    const std::span<const std::uint8_t> bytes = view_bytes(place.file, model, view, place.name);
    const std::size_t given = model.bufferViews[static_cast<std::size_t>(view)].byteStride;
    const std::size_t stride = given == 0 ? element_size : given;
    if (stride < element_size) {
        place.fail("has a stride of " + std::to_string(stride) + " bytes, its elements have " +
                   std::to_string(element_size));
    }
    if (offset > bytes.size() || element_size > bytes.size() - offset ||
        count - 1 > (bytes.size() - offset - element_size) / stride) {
        place.fail("reaches outside its buffer view: " + std::to_string(count) + " elements from byte " +
                   std::to_string(offset) + " of " + std::to_string(bytes.size()));
    }
    return {bytes.data() + offset, count, stride};
}

template <class T>
T load(const std::uint8_t* data)
{
    T value;
    std::memcpy(&value, data, sizeof value);
    return value;
}

/// glTF 2.0, section 3.6.2.2: signed values are divided by the largest one and clamped to -1.
template <class T>
float to_float(const std::uint8_t* data, bool normalized)
{
    const auto value = static_cast<float>(load<T>(data));
    if (!normalized) return value;
    return std::max(value / static_cast<float>(std::numeric_limits<T>::max()), -1.0f);
}

float component_at(const std::uint8_t* data, int component_type, bool normalized)
{
    switch (component_type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
            return to_float<std::int8_t>(data, normalized);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return to_float<std::uint8_t>(data, normalized);
        case TINYGLTF_COMPONENT_TYPE_SHORT:
            return to_float<std::int16_t>(data, normalized);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return to_float<std::uint16_t>(data, normalized);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
            return to_float<std::uint32_t>(data, normalized);
        default:
            return load<float>(data);
    }
}

std::uint32_t index_at(const std::uint8_t* data, int component_type)
{
    switch (component_type) {
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return load<std::uint8_t>(data);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return load<std::uint16_t>(data);
        default:
            return load<std::uint32_t>(data);
    }
}

bool is_index_type(int component_type)
{
    return component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
           component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
           component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

const tinygltf::Accessor& accessor_at(const GltfFile& file, const tinygltf::Model& model, int index,
                                      const std::string& what)
{
    if (index < 0 || static_cast<std::size_t>(index) >= model.accessors.size()) {
        bad_file(file, what + " names accessor " + std::to_string(index) + ", the file has " +
                           std::to_string(model.accessors.size()));
    }
    return model.accessors[static_cast<std::size_t>(index)];
}

/// Calls store(element, bytes) for each element of the accessor, then again for those that its sparse
/// part replaces.
template <class Store>
void for_each_element(const Place& place, const tinygltf::Model& model, const tinygltf::Accessor& accessor,
                      std::size_t element_size, const Store& store)
{
    if (accessor.bufferView >= 0) {
        const Elements base =
            elements_in(place, model, accessor.bufferView, accessor.byteOffset, accessor.count, element_size);
        for (std::size_t i = 0; i < base.count; ++i) store(i, base.data + i * base.stride);
    }
    if (!accessor.sparse.isSparse) return;

    const auto& sparse = accessor.sparse;
    if (sparse.count < 0 || sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0 ||
        !is_index_type(sparse.indices.componentType)) {
        place.fail("has a damaged sparse part");
    }
    const auto count = static_cast<std::size_t>(sparse.count);
    const Elements indices =
        elements_in(place, model, sparse.indices.bufferView, static_cast<std::size_t>(sparse.indices.byteOffset), count,
                    component_size(place, sparse.indices.componentType));
    const Elements values = elements_in(place, model, sparse.values.bufferView,
                                        static_cast<std::size_t>(sparse.values.byteOffset), count, element_size);
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t target = index_at(indices.data + i * indices.stride, sparse.indices.componentType);
        if (target >= accessor.count) {
            place.fail("replaces element " + std::to_string(target) + " of " + std::to_string(accessor.count));
        }
        store(target, values.data + i * values.stride);
    }
}

/// Checked before a vector of that size is made.
std::size_t element_count(const Place& place, const tinygltf::Model& model, const tinygltf::Accessor& accessor,
                          std::size_t element_size)
{
    if (accessor.bufferView >= 0) {
        return elements_in(place, model, accessor.bufferView, accessor.byteOffset, accessor.count, element_size).count;
    }
    // Zeros (glTF 2.0, section 3.6.2.3), that a sparse part may replace here and there: a sound file has a byte for
    // each of its vertices in some other attribute or index, unless they are few.
    constexpr std::size_t kFew = std::size_t{1} << 16;
    std::size_t bytes = 0;
    for (const tinygltf::Buffer& buffer : model.buffers) bytes += buffer.data.size();
    if (accessor.count > std::max(bytes, kFew)) {
        place.fail("has " + std::to_string(accessor.count) +
                   " elements without a buffer view, more than the file has bytes");
    }
    return accessor.count;
}

/// Elements of `length` components, each given to store(element, component, value).
template <class Store>
void read_components(const Place& place, const tinygltf::Model& model, const tinygltf::Accessor& accessor,
                     std::size_t length, const Store& store)
{
    const int type = accessor.componentType;
    const std::size_t size = component_size(place, type);
    for_each_element(place, model, accessor, size * length, [&](std::size_t i, const std::uint8_t* data) {
        for (std::size_t c = 0; c < length; ++c) store(i, c, component_at(data + c * size, type, accessor.normalized));
    });
}

template <class Vector>
std::vector<Vector> read_vectors(const GltfFile& file, const tinygltf::Model& model, int index, int gltf_type,
                                 const std::string& what)
{
    const tinygltf::Accessor& accessor = accessor_at(file, model, index, what);
    const Place place{file, what + " (accessor " + std::to_string(index) + ")"};
    if (accessor.type != gltf_type) {
        place.fail("has elements of another size, expected VEC" + std::to_string(Vector::length()));
    }
    constexpr auto kLength = static_cast<std::size_t>(Vector::length());
    const std::size_t size = component_size(place, accessor.componentType) * kLength;
    std::vector<Vector> vectors(element_count(place, model, accessor, size), Vector(0.0f));
    read_components(place, model, accessor, kLength, [&](std::size_t i, std::size_t c, float value) {
        vectors[i][static_cast<glm::length_t>(c)] = value;
    });
    return vectors;
}

}  // namespace

std::span<const std::uint8_t> view_bytes(const GltfFile& file, const tinygltf::Model& model, int view,
                                         const std::string& what)
{
    if (view < 0 || static_cast<std::size_t>(view) >= model.bufferViews.size()) {
        bad_file(file, what + " names buffer view " + std::to_string(view) + ", the file has " +
                           std::to_string(model.bufferViews.size()));
    }
    const tinygltf::BufferView& range = model.bufferViews[static_cast<std::size_t>(view)];
    if (range.buffer < 0 || static_cast<std::size_t>(range.buffer) >= model.buffers.size()) {
        bad_file(file, what + " names a buffer that the file does not have");
    }
    const std::vector<unsigned char>& data = model.buffers[static_cast<std::size_t>(range.buffer)].data;
    if (range.byteOffset > data.size() || range.byteLength > data.size() - range.byteOffset) {
        bad_file(file, what + ": buffer view " + std::to_string(view) + " reaches outside its buffer");
    }
    return {data.data() + range.byteOffset, range.byteLength};
}

std::vector<glm::vec3> read_vec3(const GltfFile& file, const tinygltf::Model& model, int accessor,
                                 const std::string& what)
{
    return read_vectors<glm::vec3>(file, model, accessor, TINYGLTF_TYPE_VEC3, what);
}

std::vector<glm::vec2> read_vec2(const GltfFile& file, const tinygltf::Model& model, int accessor,
                                 const std::string& what)
{
    return read_vectors<glm::vec2>(file, model, accessor, TINYGLTF_TYPE_VEC2, what);
}

std::vector<glm::vec4> read_vec4(const GltfFile& file, const tinygltf::Model& model, int accessor,
                                 const std::string& what)
{
    return read_vectors<glm::vec4>(file, model, accessor, TINYGLTF_TYPE_VEC4, what);
}

std::vector<glm::vec4> read_colors(const GltfFile& file, const tinygltf::Model& model, int accessor,
                                   const std::string& what)
{
    if (accessor_at(file, model, accessor, what).type != TINYGLTF_TYPE_VEC3) {
        return read_vec4(file, model, accessor, what);
    }
    const std::vector<glm::vec3> rgb = read_vec3(file, model, accessor, what);
    std::vector<glm::vec4> colors;
    colors.reserve(rgb.size());
    for (const glm::vec3& color : rgb) colors.emplace_back(color, 1.0f);
    return colors;
}

std::vector<glm::mat4> read_mat4(const GltfFile& file, const tinygltf::Model& model, int index, const std::string& what)
{
    const tinygltf::Accessor& accessor = accessor_at(file, model, index, what);
    const Place place{file, what + " (accessor " + std::to_string(index) + ")"};
    if (accessor.type != TINYGLTF_TYPE_MAT4 || accessor.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT) {
        place.fail("has elements of another type, expected MAT4 of floats");
    }
    std::vector<glm::mat4> matrices(element_count(place, model, accessor, sizeof(glm::mat4)), glm::mat4(0.0f));
    read_components(place, model, accessor, 16, [&](std::size_t i, std::size_t c, float value) {
        matrices[i][static_cast<glm::length_t>(c / 4)][static_cast<glm::length_t>(c % 4)] = value;
    });
    return matrices;
}

std::vector<float> read_scalars(const GltfFile& file, const tinygltf::Model& model, int index, const std::string& what)
{
    const tinygltf::Accessor& accessor = accessor_at(file, model, index, what);
    const Place place{file, what + " (accessor " + std::to_string(index) + ")"};
    if (accessor.type != TINYGLTF_TYPE_SCALAR) place.fail("has elements of another size, expected SCALAR");
    std::vector<float> scalars(element_count(place, model, accessor, component_size(place, accessor.componentType)));
    read_components(place, model, accessor, 1, [&](std::size_t i, std::size_t, float value) { scalars[i] = value; });
    return scalars;
}

std::size_t accessor_count(const GltfFile& file, const tinygltf::Model& model, int accessor, const std::string& what)
{
    return accessor_at(file, model, accessor, what).count;
}

std::vector<std::uint32_t> read_indices(const GltfFile& file, const tinygltf::Model& model, int index,
                                        const std::string& what)
{
    const tinygltf::Accessor& accessor = accessor_at(file, model, index, what);
    const Place place{file, what + " (accessor " + std::to_string(index) + ")"};
    const int type = accessor.componentType;
    if (accessor.type != TINYGLTF_TYPE_SCALAR || !is_index_type(type)) {
        place.fail("has component type " + std::to_string(type) + ", expected unsigned 8, 16 or 32 bit scalars");
    }
    const std::size_t size = component_size(place, type);
    std::vector<std::uint32_t> indices(element_count(place, model, accessor, size));
    for_each_element(place, model, accessor, size,
                     [&](std::size_t i, const std::uint8_t* data) { indices[i] = index_at(data, type); });
    return indices;
}

}  // namespace rcs
