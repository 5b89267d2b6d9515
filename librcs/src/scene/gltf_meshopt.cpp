#include "scene/gltf_meshopt.h"

#include <utility>

#include <meshoptimizer.h>

namespace rcs {
namespace {

template <class Value>
Value choice(const GltfDocument& document, const Json& extension, const char* key, const std::string& what,
             std::initializer_list<std::pair<const char*, Value>> choices, const char* missing)
{
    const auto found = extension.find(key);
    const std::string text = found == extension.end() ? missing : found->is_string() ? found->get<std::string>() : "";
    std::string names;
    for (const auto& [name, value] : choices) {
        if (text == name) return value;
        names.append(names.empty() ? "" : ", ").append(name);
    }
    bad_file(document.file, what + ": '" + key + "' of its EXT_meshopt_compression is none of " + names);
}

bool has_layout(const PackedView& view)
{
    using Mode = PackedView::Mode;
    using Filter = PackedView::Filter;
    if (view.mode != Mode::attributes) {
        return (view.stride == 2 || view.stride == 4) && view.filter == Filter::none &&
               (view.mode == Mode::indices || view.count % 3 == 0);
    }
    if (view.stride < 4 || view.stride > 256 || view.stride % 4 != 0) return false;
    if (view.filter == Filter::octahedral) return view.stride == 4 || view.stride == 8;
    return view.filter != Filter::quaternion || view.stride == 8;
}

/// @return 0 if the packed bytes are sound
int unpack(const PackedView& view, const unsigned char* packed, unsigned char* elements)
{
    using Mode = PackedView::Mode;
    switch (view.mode) {
        case Mode::triangles:
            return meshopt_decodeIndexBuffer(elements, view.count, view.stride, packed, view.length);
        case Mode::indices:
            return meshopt_decodeIndexSequence(elements, view.count, view.stride, packed, view.length);
        case Mode::attributes:
            break;
    }
    const int problem = meshopt_decodeVertexBuffer(elements, view.count, view.stride, packed, view.length);
    if (problem != 0) return problem;
    switch (view.filter) {
        case PackedView::Filter::octahedral:
            meshopt_decodeFilterOct(elements, view.count, view.stride);
            break;
        case PackedView::Filter::quaternion:
            meshopt_decodeFilterQuat(elements, view.count, view.stride);
            break;
        case PackedView::Filter::exponential:
            meshopt_decodeFilterExp(elements, view.count, view.stride);
            break;
        case PackedView::Filter::none:
            break;
    }
    return 0;
}

}  // namespace

PackedView packed_view(const GltfDocument& document, const Json& extension, std::size_t view, const std::string& what)
{
    using Mode = PackedView::Mode;
    using Filter = PackedView::Filter;
    const std::string name = what + ", EXT_meshopt_compression";
    const Json& buffer = element_of(document, "buffers", extension, "buffer", name);
    PackedView packed;
    packed.view = view;
    packed.buffer = *whole_number(document, extension, "buffer", name);
    packed.offset = whole_number(document, extension, "byteOffset", name).value_or(0);
    packed.length = whole_number(document, extension, "byteLength", name).value_or(0);
    packed.stride = whole_number(document, extension, "byteStride", name).value_or(0);
    packed.count = whole_number(document, extension, "count", name).value_or(0);
    packed.mode = choice<Mode>(
        document, extension, "mode", what,
        {{"ATTRIBUTES", Mode::attributes}, {"TRIANGLES", Mode::triangles}, {"INDICES", Mode::indices}}, "");
    packed.filter = choice<Filter>(document, extension, "filter", what,
                                   {{"NONE", Filter::none},
                                    {"OCTAHEDRAL", Filter::octahedral},
                                    {"QUATERNION", Filter::quaternion},
                                    {"EXPONENTIAL", Filter::exponential}},
                                   "NONE");
    const std::size_t size = *whole_number(document, buffer, "byteLength", name);
    if (packed.length < 1 || packed.offset > size || packed.length > size - packed.offset) {
        bad_file(document.file, name + " has " + std::to_string(packed.length) + " bytes from byte " +
                                    std::to_string(packed.offset) + ", its buffer has " + std::to_string(size));
    }
    // Sixteen bytes of zeros are packed into two bits, which is the most that any mode saves; the format's
    // header is small beside the spare factor of 2.
    constexpr std::size_t kMostSaved = 128;
    if (packed.count < 1 || !has_layout(packed) || packed.count > packed.length * kMostSaved / packed.stride) {
        bad_file(document.file, name + " has " + std::to_string(packed.count) + " elements of " +
                                    std::to_string(packed.stride) + " bytes in " + std::to_string(packed.length) +
                                    " bytes, which its mode and filter do not allow");
    }
    return packed;
}

void unpack_views(const GltfFile& file, const std::vector<PackedView>& views, tinygltf::Model& model)
{
    for (const PackedView& view : views) {
        const std::vector<unsigned char>& packed = model.buffers[view.buffer].data;
        const std::string what = element_name("buffer view", view.view, "");
        if (view.offset > packed.size() || view.length > packed.size() - view.offset) {
            bad_file(file, what + ": its EXT_meshopt_compression reaches outside its buffer");
        }
        tinygltf::Buffer buffer;
        buffer.data.resize(view.count * view.stride);
        if (unpack(view, packed.data() + view.offset, buffer.data.data()) != 0) {
            bad_file(file, what + ": its EXT_meshopt_compression data are damaged");
        }
        tinygltf::BufferView& target = model.bufferViews[view.view];
        target.buffer = static_cast<int>(model.buffers.size());
        target.byteOffset = 0;
        target.byteLength = buffer.data.size();
        model.buffers.push_back(std::move(buffer));
    }
}

}  // namespace rcs
