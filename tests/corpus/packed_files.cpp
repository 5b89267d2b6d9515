#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <meshoptimizer.h>

#include "corpus/corpus.h"

// EXT_meshopt_compression and KHR_draco_mesh_compression.

namespace rcs::test {
namespace {

using Bytes = std::vector<unsigned char>;

std::string text_of(const Bytes& bytes) { return {bytes.begin(), bytes.end()}; }

template <class T>
std::string packed_vertices(const std::vector<T>& values, std::size_t count)
{
    const std::size_t stride = values.size() * sizeof(T) / count;
    Bytes bytes(meshopt_encodeVertexBufferBound(count, stride));
    bytes.resize(meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), values.data(), count, stride));
    return text_of(bytes);
}

const std::vector<unsigned> kIndices = {0, 1, 2, 0, 2, 3};

std::string packed_triangles()
{
    Bytes bytes(meshopt_encodeIndexBufferBound(6, 4));
    bytes.resize(meshopt_encodeIndexBuffer(bytes.data(), bytes.size(), kIndices.data(), 6));
    return text_of(bytes);
}

std::string packed_sequence()
{
    Bytes bytes(meshopt_encodeIndexSequenceBound(6, 4));
    bytes.resize(meshopt_encodeIndexSequence(bytes.data(), bytes.size(), kIndices.data(), 6));
    return text_of(bytes);
}

/// Makes view `view` a packed one. Its own bytes, which readers without the extension would use, become ones.
void pack(Draft& d, int view, const std::string& bytes, std::size_t count, std::size_t stride, Json more)
{
    const int source = d.b.add_view(bytes);
    more.update({{"buffer", 0},
                 {"byteOffset", d.view(source)["byteOffset"]},
                 {"byteLength", bytes.size()},
                 {"byteStride", stride},
                 {"count", count}});
    const std::size_t offset = d.view(view)["byteOffset"];
    const std::size_t length = d.view(view)["byteLength"];
    d.b.binary.replace(offset, length, std::string(length, '\x7f'));
    d.view(view)["extensions"]["EXT_meshopt_compression"] = more;
}

const std::vector<float> kQuad = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};

Corpus::Change packed_positions(const Json& change = Json::object(),
                                const std::string& bytes = packed_vertices(kQuad, 4))
{
    return [=](Draft& d) {
        pack(d, 0, bytes, 4, 12, {{"mode", "ATTRIBUTES"}});
        d.view(0)["extensions"]["EXT_meshopt_compression"].merge_patch(change);
    };
}

/// Four normals (0, 0, 1) through the octahedral filter.
void filtered_normals(Draft& d)
{
    const std::vector<float> normals = {0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0};
    std::vector<std::int8_t> filtered(16);
    meshopt_encodeFilterOct(filtered.data(), 4, 4, 8, normals.data());
    const int accessor = d.b.add_accessor(d.b.add_view(raw(filtered), 4), kByte, "VEC3", 4);
    d.accessor(accessor)["normalized"] = true;
    pack(d, d.accessor(accessor)["bufferView"], packed_vertices(filtered, 4), 4, 4,
         {{"mode", "ATTRIBUTES"}, {"filter", "OCTAHEDRAL"}});
    d.attributes()["NORMAL"] = accessor;
}

/// The quad's positions through the exponential filter: each number an exponent of 8 and a mantissa of 24 bits.
void filtered_positions(Draft& d)
{
    std::vector<std::uint32_t> filtered;
    for (const float value : kQuad) filtered.push_back(static_cast<std::uint32_t>(static_cast<int>(value)) & 0xffffffu);
    pack(d, 0, packed_vertices(filtered, 4), 4, 12, {{"mode", "ATTRIBUTES"}, {"filter", "EXPONENTIAL"}});
}

/// The quad as Draco data with their ids. @param fault  changes the extension  @param color  how its colours are held:
/// a byte each
Corpus::Change draco_quad(const std::function<void(Draft&, Json& extension)>& fault = {},
                          draco::DataType color = draco::DT_UINT8)
{
    return [=](Draft& d) {
        draco::TriangleSoupMeshBuilder builder;
        builder.Start(2);
        const int positions = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
        const int colors = builder.AddAttribute(draco::GeometryAttribute::COLOR, 4, color);
        const auto corner = [](unsigned i) { return kQuad.data() + 3 * i; };
        const std::array<std::uint8_t, 4> red = {255, 0, 0, 255};
        for (unsigned face = 0; face < 2; ++face) {
            const unsigned* k = kIndices.data() + 3 * face;
            builder.SetAttributeValuesForFace(positions, draco::FaceIndex(face), corner(k[0]), corner(k[1]),
                                              corner(k[2]));
            builder.SetAttributeValuesForFace(colors, draco::FaceIndex(face), red.data(), red.data(), red.data());
        }
        const std::unique_ptr<draco::Mesh> mesh = builder.Finalize();
        draco::EncoderBuffer data;
        draco::Encoder encoder;
        if (!encoder.EncodeMeshToBuffer(*mesh, &data).ok()) throw std::runtime_error("Draco cannot encode the quad");
        const int view = d.b.add_view(std::string(data.data(), data.size()));
        Json extension = {{"bufferView", view},
                          {"attributes",
                           {{"POSITION", mesh->attribute(positions)->unique_id()},
                            {"COLOR_0", mesh->attribute(colors)->unique_id()}}}};
        const std::size_t points = mesh->num_points();
        d.attributes() = {
            {"POSITION", d.b.add("accessors", {{"componentType", kFloat}, {"type", "VEC3"}, {"count", points}})},
            {"COLOR_0",
             d.b.add("accessors",
                     {{"componentType", kUnsignedByte}, {"type", "VEC4"}, {"count", points}, {"normalized", true}})}};
        d.primitive["indices"] =
            d.b.add("accessors", {{"componentType", kUnsignedShort}, {"type", "SCALAR"}, {"count", 6}});
        if (fault) fault(d, extension);
        d.primitive["extensions"]["KHR_draco_mesh_compression"] = extension;
    };
}

}  // namespace

void add_packed_files(Corpus& c)
{
    c.renders("meshopt_attributes", packed_positions());
    c.renders("meshopt_triangles", [](Draft& d) {
        d.primitive["indices"] = d.b.add_indices<std::uint32_t>(kIndices);
        pack(d, 3, packed_triangles(), 6, 4, {{"mode", "TRIANGLES"}});
    });
    c.renders("meshopt_indices", [](Draft& d) {
        d.primitive["indices"] = d.b.add_indices<std::uint32_t>(kIndices);
        pack(d, 3, packed_sequence(), 6, 4, {{"mode", "INDICES"}});
    });
    c.renders("meshopt_octahedral", filtered_normals);
    c.renders("meshopt_exponential", filtered_positions);
    c.renders("meshopt_fallback_buffer", [](Draft& d) {
        packed_positions()(d);
        d.buffer_uri = "data.bin";
        d.beside.emplace_back("data.bin", "BUFFER");
        d.view(0)["buffer"] = 1;
        d.view(0)["byteOffset"] = 0;
        d.b.more_buffers =
            Json::array({{{"byteLength", 48}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}}});
    });
    c.renders("meshopt_fallback_buffer_unmarked", [](Draft& d) {
        packed_positions()(d);
        d.view(0)["buffer"] = 1;
        d.view(0)["byteOffset"] = 0;
        d.b.more_buffers = Json::array({{{"byteLength", 48}}});
    });
    c.fails("meshopt_unpacked_view_of_fallback", "outside its buffer", [](Draft& d) {
        d.view(0)["buffer"] = 1;
        d.view(0)["byteOffset"] = 0;
        d.b.more_buffers =
            Json::array({{{"byteLength", 48}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}}});
    });
    c.fails("meshopt_image_in_fallback", "holds nothing", [](Draft& d) {
        d.b.more_buffers =
            Json::array({{{"byteLength", 48}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}}});
        d.root()["images"] = Json::array({{{"bufferView", d.b.add_view("none")}}});
        d.view(3)["buffer"] = 1;
        d.view(3)["byteOffset"] = 20;
    });
    c.fails("meshopt_damaged", "damaged", packed_positions(Json::object(), std::string(40, '\x55')));
    c.fails("meshopt_cut_short", "damaged", packed_positions(Json::object(), packed_vertices(kQuad, 4).substr(0, 20)));
    c.fails("meshopt_mode_unknown", "mode", packed_positions({{"mode", "POINTS"}}));
    c.fails("meshopt_filter_unknown", "filter", packed_positions({{"filter", "SHARP"}}));
    c.fails("meshopt_filter_of_other_stride", "filter", packed_positions({{"filter", "QUATERNION"}}));
    c.fails("meshopt_stride_odd", "elements", packed_positions({{"byteStride", 7}}));
    c.fails("meshopt_count_of_all_memory", "elements", packed_positions({{"count", 1ull << 40}}));
    c.fails("meshopt_count_missing", "elements", packed_positions({{"count", nullptr}}));
    c.fails("meshopt_outside_buffer", "its buffer has", packed_positions({{"byteOffset", 100000}}));
    c.fails("meshopt_of_no_buffer", "'buffer'", packed_positions({{"buffer", 3}}));
    c.fails("meshopt_is_no_object", "EXT_meshopt_compression",
            [](Draft& d) { d.view(0)["extensions"]["EXT_meshopt_compression"] = 1; });

    c.renders("draco", draco_quad());
    c.fails("draco_damaged", "Draco", draco_quad([](Draft& d, Json& e) {
                d.b.binary.replace(d.view(e["bufferView"])["byteOffset"].get<std::size_t>(), 5, "ocard");
            }));
    c.fails("draco_cut_short", "Draco",
            draco_quad([](Draft& d, Json& e) { d.view(e["bufferView"])["byteLength"] = 20; }));
    c.fails("draco_attribute_unknown", "attribute 9",
            draco_quad([](Draft&, Json& e) { e["attributes"]["POSITION"] = 9; }));
    c.fails("draco_without_indices", "'indices'", draco_quad([](Draft& d, Json&) { d.primitive.erase("indices"); }));
    c.fails("draco_view_unknown", "'bufferView'", draco_quad([](Draft&, Json& e) { e["bufferView"] = 99; }));
    c.fails("draco_without_attributes", "attributes", draco_quad([](Draft&, Json& e) { e.erase("attributes"); }));
    c.fails("draco_of_another_version", "expected a mesh, 1, and version 2.2", draco_quad([](Draft& d, Json& e) {
                d.b.binary[d.view(e["bufferView"])["byteOffset"].get<std::size_t>() + 6] = 1;
            }));
    c.fails("draco_of_all_memory", "faces or vertices in", draco_quad([](Draft& d, Json& e) {
                // After the header and the kind of traversal: 2^28 - 1 and as many.
                d.b.binary.replace(d.view(e["bufferView"])["byteOffset"].get<std::size_t>() + 12, 8,
                                   "\xff\xff\xff\x7f\xff\xff\xff\x7f");
            }));
    c.fails("draco_of_truth_values", "COLOR_0 as true or false", draco_quad({}, draco::DT_BOOL));
}

}  // namespace rcs::test
