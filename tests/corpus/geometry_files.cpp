#include <limits>

#include "corpus/corpus.h"

// Accessors, attributes and primitives.

namespace rcs::test {
namespace {

/// Another mesh with its node, so that the quad stays in view.
void add_mesh(Draft& d, Json primitive)
{
    d.root()["meshes"].push_back({{"name", "other"}, {"primitives", Json::array({std::move(primitive)})}});
    d.root()["nodes"].push_back({{"mesh", 1}});
}

/// Four elements of an attribute. @param stride  0: packed
template <class T>
int four(Draft& d, const std::vector<T>& values, int type, const char* shape, bool normalized, std::size_t stride = 0)
{
    const int accessor = d.b.add_accessor(d.b.add_view(raw(values), stride), type, shape, 4);
    d.accessor(accessor)["normalized"] = normalized;
    return accessor;
}

/// The attribute's accessor, of floats.
Corpus::Change floats(const char* attribute, const char* shape, const std::vector<float>& values)
{
    return [=](Draft& d) { d.attributes()[attribute] = four(d, values, kFloat, shape, false); };
}

template <class T>
Corpus::Change integers(const char* attribute, const char* shape, int type, const std::vector<T>& values,
                        std::size_t stride = 0, double scale = 0.0)
{
    return [=](Draft& d) {
        d.attributes()[attribute] = four(d, values, type, shape, scale == 0.0, stride);
        if (scale > 0.0) d.node["scale"] = {scale, scale, scale};
    };
}

Corpus::Change sparse(const Json& change)
{
    return [=](Draft& d) {
        Json sparse = {
            {"count", 1},
            {"indices", {{"bufferView", d.b.add_view(raw<std::uint8_t>({2}))}, {"componentType", kUnsignedByte}}},
            {"values", {{"bufferView", d.b.add_view(raw<glm::vec3>({{0.5f, 0.5f, 0}}))}}}};
        sparse.merge_patch(change);
        d.accessor(0)["sparse"] = sparse;
    };
}

template <class T>
Corpus::Change indices(const std::vector<T>& values, int mode = kTriangles)
{
    return [=](Draft& d) {
        d.primitive["indices"] = d.b.add_indices(values);
        d.primitive["mode"] = mode;
    };
}

Corpus::Change accessor(int index, const char* key, const Json& value)
{
    return [=](Draft& d) { d.accessor(index)[key] = value; };
}

void add_attribute_files(Corpus& c)
{
    c.renders("normal_float", floats("NORMAL", "VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}));
    c.renders("normal_bytes", integers<std::int8_t>("NORMAL", "VEC3", kByte,
                                                    {0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0}, 4));
    c.renders("position_shorts", integers<std::int16_t>("POSITION", "VEC3", kShort,
                                                        {-9, -9, 0, 0, 9, -9, 0, 0, 9, 9, 0, 0, -9, 9, 0, 0}, 8, 0.1));
    c.renders("position_bytes_normalized",
              integers<std::int8_t>("POSITION", "VEC3", kByte,
                                    {-127, -127, 0, 0, 127, -127, 0, 0, 127, 127, 0, 0, -127, 127, 0, 0}, 4));
    c.renders("position_unsigned_normalized",
              integers<std::uint16_t>("POSITION", "VEC3", kUnsignedShort,
                                      {0, 0, 0, 0, 65535, 0, 0, 0, 65535, 65535, 0, 0, 0, 65535, 0, 0}, 8));
    c.renders("uv_bytes",
              integers<std::uint8_t>("TEXCOORD_0", "VEC2", kUnsignedByte, {0, 255, 255, 255, 255, 0, 0, 0}));
    c.renders("uv_shorts",
              integers<std::uint16_t>("TEXCOORD_0", "VEC2", kUnsignedShort, {0, 65535, 65535, 65535, 65535, 0, 0, 0}));
    c.renders("uv_second_set", floats("TEXCOORD_1", "VEC2", {0, 0, 1, 0, 1, 1, 0, 1}));
    c.renders("color_rgb", floats("COLOR_0", "VEC3", {1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1}));
    c.renders("color_rgba", floats("COLOR_0", "VEC4", {1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1, 1, 1, 1, 0.5f}));
    c.renders("color_bytes",
              integers<std::uint8_t>("COLOR_0", "VEC4", kUnsignedByte, std::vector<std::uint8_t>(16, 200)));
    c.renders("color_bytes_rgb",
              integers<std::uint8_t>("COLOR_0", "VEC3", kUnsignedByte, std::vector<std::uint8_t>(16, 200), 4));
    c.renders("color_shorts",
              integers<std::uint16_t>("COLOR_0", "VEC4", kUnsignedShort, std::vector<std::uint16_t>(16, 9000)));
    c.notes("color_too_bright", "vertex colours outside", floats("COLOR_0", "VEC3", std::vector<float>(12, 3.0f)));
    c.renders("attribute_of_its_own", floats("_HEAT", "VEC2", std::vector<float>(8, 1.0f)));
    const float nan = std::numeric_limits<float>::quiet_NaN();
    c.notes("normal_zero", "normals that are zero", floats("NORMAL", "VEC3", std::vector<float>(12, 0.0f)));
    c.notes("uv_not_finite", "texture coordinates that are not finite",
            floats("TEXCOORD_0", "VEC2", std::vector<float>(8, nan)));

    c.fails("position_nan", "coordinate", floats("POSITION", "VEC3", std::vector<float>(12, nan)));
    c.fails("position_infinite", "coordinate", floats("POSITION", "VEC3", std::vector<float>(12, HUGE_VALF)));
    c.fails("position_of_two", "VEC3", floats("POSITION", "VEC2", std::vector<float>(8, 0.0f)));
    c.fails("normal_of_four", "NORMAL", floats("NORMAL", "VEC4", std::vector<float>(16, 1.0f)));
    c.fails("uv_of_three", "TEXCOORD_0", floats("TEXCOORD_0", "VEC3", std::vector<float>(12, 1.0f)));
    c.fails("color_of_two", "COLOR_0", floats("COLOR_0", "VEC2", std::vector<float>(8, 1.0f)));
    for (const char* name : {"NORMAL", "COLOR_0"}) {
        c.fails(std::string("too_few_of_") + name, name,
                [name](Draft& d) { d.attributes()[name] = d.b.add_vec3({{0, 0, 1}}); });
    }
    c.fails("too_few_of_TEXCOORD_0", "TEXCOORD_0",
            [](Draft& d) { d.attributes()["TEXCOORD_0"] = d.b.add_vec2({{0, 1}}); });
    c.fails("attribute_of_no_accessor", "NORMAL", [](Draft& d) { d.attributes()["NORMAL"] = 99; });
    c.fails("attribute_negative", "NORMAL", [](Draft& d) { d.attributes()["NORMAL"] = -1; });
    c.fails("attribute_is_text", "NORMAL", [](Draft& d) { d.attributes()["NORMAL"] = "0"; });
    c.fails("attributes_missing", "attributes", [](Draft& d) { d.primitive.erase("attributes"); });
}

void add_accessor_files(Corpus& c)
{
    c.renders("accessor_interleaved", [](Draft& d) {
        const int view = d.b.add_view(raw<float>({-1, -1, 0, 0, 1, 1, -1, 0, 1, 1, 1, 1, 0, 1, 0, -1, 1, 0, 0, 0}), 20);
        d.attributes() = {{"POSITION", d.b.add_accessor(view, kFloat, "VEC3", 4)},
                          {"TEXCOORD_0", d.b.add_accessor(view, kFloat, "VEC2", 4, 12)}};
    });
    c.renders("sparse", sparse(Json::object()));
    c.renders("sparse_without_base", [](Draft& d) {
        sparse({{"count", 2}})(d);
        d.accessor(0).erase("bufferView");
        auto& part = d.accessor(0)["sparse"];
        part["indices"]["bufferView"] = d.b.add_view(raw<std::uint8_t>({1, 2}));
        part["values"]["bufferView"] = d.b.add_view(raw<glm::vec3>({{1, 0, 0}, {1, 1, 0}}));
        d.primitive["indices"] = d.b.add_indices<std::uint8_t>({0, 1, 2});
    });
    c.renders("sparse_short_indices", [](Draft& d) {
        sparse({{"indices", {{"componentType", kUnsignedShort}}}})(d);
        d.accessor(0)["sparse"]["indices"]["bufferView"] = d.b.add_view(raw<std::uint16_t>({2}));
    });
    c.fails("sparse_target_outside", "element 9 of 4", [](Draft& d) {
        sparse(Json::object())(d);
        d.accessor(0)["sparse"]["indices"]["bufferView"] = d.b.add_view(raw<std::uint8_t>({9}));
    });
    c.fails("sparse_count_too_large", "buffer view", sparse({{"count", 100000}}));
    c.fails("sparse_count_negative", "'count'", sparse({{"count", -1}}));
    c.fails("sparse_without_values", "'values'", sparse({{"values", nullptr}}));
    c.fails("sparse_values_nowhere", "buffer view 77", sparse({{"values", {{"bufferView", 77}}}}));
    c.fails("sparse_float_indices", "sparse", sparse({{"indices", {{"componentType", kFloat}}}}));
    c.fails("sparse_of_all_memory", "more than the file has bytes", [](Draft& d) {
        sparse(Json::object())(d);
        d.accessor(0).erase("bufferView");
        d.accessor(0)["count"] = 4000000000u;
    });
    c.renders("uvs_that_are_not_stored", [](Draft& d) {
        d.attributes()["TEXCOORD_0"] =
            d.b.add("accessors", {{"componentType", kFloat}, {"type", "VEC2"}, {"count", 4}});
    });
    c.fails("count_too_large", "outside its buffer view", accessor(0, "count", 5));
    c.fails("count_of_all_memory", "outside its buffer view", accessor(0, "count", 1ull << 62));
    c.fails("count_negative", "'count'", accessor(0, "count", -3));
    c.fails("count_missing", "'count'", [](Draft& d) { d.accessor(0).erase("count"); });
    c.fails("offset_outside", "outside its buffer view", accessor(0, "byteOffset", 4096));
    c.fails("offset_is_text", "'byteOffset'", accessor(0, "byteOffset", "0"));
    c.fails("stride_too_small", "stride", [](Draft& d) { d.view(0)["byteStride"] = 4; });
    c.fails("component_type_unknown", "component type", accessor(0, "componentType", 5124));
    c.fails("shape_unknown", "type", accessor(0, "type", "VEC9"));
    c.fails("view_unknown", "buffer view 55", accessor(0, "bufferView", 55));
}

void add_primitive_files(Corpus& c)
{
    c.renders("indices_bytes", indices<std::uint8_t>({0, 1, 2, 0, 2, 3}));
    c.renders("indices_ints", indices<std::uint32_t>({0, 1, 2, 0, 2, 3}));
    c.renders("indices_none", [](Draft& d) {
        d.primitive.erase("indices");
        d.primitive["mode"] = kTriangleFan;
    });
    c.renders("strip", indices<std::uint16_t>({0, 1, 3, 2}, kTriangleStrip));
    c.renders("fan", indices<std::uint16_t>({0, 1, 2, 3}, kTriangleFan));
    c.notes("indices_left_over", "no whole triangle", indices<std::uint16_t>({0, 1, 2, 0, 2, 3, 1}));
    c.notes("triangle_without_area", "without area", indices<std::uint16_t>({0, 1, 2, 0, 2, 3, 1, 1, 1}));
    c.notes("points", "points or lines",
            [](Draft& d) { add_mesh(d, {{"attributes", {{"POSITION", 0}}}, {"mode", kPoints}}); });
    c.notes("lines", "points or lines",
            [](Draft& d) { add_mesh(d, {{"attributes", {{"POSITION", 0}}}, {"mode", 3}}); });
    c.notes("no_positions", "without positions", [](Draft& d) { add_mesh(d, {{"attributes", Json::object()}}); });
    c.renders("two_primitives", [](Draft& d) { d.mesh["primitives"] = {d.primitive, d.primitive}; });
    c.renders("mesh_unused", [](Draft& d) {
        d.root()["meshes"].push_back({{"primitives", Json::array({{{"attributes", {{"POSITION", 0}}}}})}});
    });
    c.renders("no_material", [](Draft& d) { d.material = nullptr; });
    c.fails("index_outside", "vertex 4", indices<std::uint8_t>({0, 1, 4}));
    c.fails("indices_float", "indices",
            [](Draft& d) { d.primitive["indices"] = four(d, std::vector<float>(4), kFloat, "SCALAR", false); });
    c.fails("indices_vectors", "indices", [](Draft& d) { d.primitive["indices"] = 0; });
    c.fails("indices_unknown", "'indices'", [](Draft& d) { d.primitive["indices"] = 50; });
    c.fails("mode_unknown", "mode 9", [](Draft& d) { d.primitive["mode"] = 9; });
    c.fails("mode_is_text", "'mode'", [](Draft& d) { d.primitive["mode"] = "TRIANGLES"; });
    c.fails("primitives_missing", "primitives", [](Draft& d) { d.mesh["primitives"] = 0; });
    c.fails("material_unknown", "material 3", [](Draft& d) {
        d.material = nullptr;
        d.primitive["material"] = 3;
    });
}

}  // namespace

void add_geometry_files(Corpus& corpus)
{
    add_attribute_files(corpus);
    add_accessor_files(corpus);
    add_primitive_files(corpus);
}

}  // namespace rcs::test
