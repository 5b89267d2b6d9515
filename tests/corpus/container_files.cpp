#include "corpus/corpus.h"

// How a file is put together, and where the parts that lie outside of it may be.

namespace rcs::test {
namespace {

std::string base64(const std::string& bytes)
{
    const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        }
        for (std::size_t k = 0; k < 4; ++k) {
            text += i + k > bytes.size() ? '=' : digits[bits >> (18 - 6 * k) & 63];
        }
    }
    return text;
}

std::string glb_of(const std::function<void(Json&)>& change = {})
{
    Draft draft;
    draft.complete();
    if (change) change(draft.root());
    return draft.b.glb();
}

Corpus::Change buffer_at(const std::string& uri, const std::string& path = "")
{
    return [=](Draft& d) {
        d.buffer_uri = uri;
        d.beside.emplace_back(path.empty() ? "data.bin" : path, "BUFFER");
    };
}

Corpus::Change image_at(const std::string& uri, const std::string& path = "")
{
    return [=](Draft& d) {
        d.root()["images"] = Json::array({{{"uri", uri}}});
        d.root()["textures"] = Json::array({{{"source", 0}}});
        d.pbr()["baseColorTexture"] = {{"index", 0}};
        if (!path.empty()) d.beside.emplace_back(path, kPicture);
    };
}

}  // namespace

void add_container_files(Corpus& c)
{
    c.renders("container_plain", [](Draft&) {});
    c.renders("buffer_beside", buffer_at("data.bin"));
    c.renders("buffer_in_folder", buffer_at("a/b/data.bin", "a/b/data.bin"));
    c.renders("buffer_percent_encoded", buffer_at("my%20data%2B.bin", "my data+.bin"));
    c.renders("buffer_plus_in_name", buffer_at("a+b.bin", "a+b.bin"));
    c.renders("buffer_longer_than_said", [](Draft& d) {
        buffer_at("data.bin")(d);
        d.beside.back().second = d.b.binary + "more";
    });
    c.renders("buffer_without_uri_unused", [](Draft& d) { d.b.more_buffers = Json::array({{{"byteLength", 100}}}); });
    c.renders("buffer_as_text",
              [](Draft& d) { d.buffer_uri = "data:application/octet-stream;base64," + base64(d.b.binary); });
    c.renders("buffer_as_text_of_no_type", [](Draft& d) { d.buffer_uri = "data:;base64," + base64(d.b.binary); });
    c.renders("image_beside", image_at("p.png", "p.png"));
    c.renders("image_in_folder", image_at("t/p%31.png", "t/p1.png"));
    c.renders("image_as_text", [](Draft& d) { image_at("data:image/png;base64," + base64(kPicture))(d); });
    c.renders("image_as_text_webp", [](Draft& d) { image_at("data:image/webp;base64," + base64(kWebpPicture))(d); });
    c.renders("image_elsewhere_but_unused",
              [](Draft& d) { d.root()["images"] = Json::array({{{"uri", "../x.png"}}}); });
    c.renders("whole_numbers_as_fractions", [](Draft& d) {
        d.accessor(0)["count"] = 4.0;
        d.accessor(2)["componentType"] = static_cast<double>(kUnsignedShort);
        d.view(0)["byteLength"] = 48.0;
        d.attributes()["POSITION"] = 0.0;
        d.primitive["indices"] = 2.0;
        d.node["mesh"] = 0.0;
        d.root()["scenes"] = Json::array({{{"nodes", {0.0, 1.0, 2.0}}}});
        d.root()["scene"] = 0.0;
    });
    c.renders("extras_anywhere", [](Draft& d) {
        for (Json* json : {&d.root(), &d.node, &d.material, &d.primitive})
            (*json)["extras"] = {{"a", {1, "b", nullptr}}};
    });
    c.notes("extension_unknown", "MY_extension", [](Draft& d) { d.root()["extensionsUsed"] = {"MY_extension"}; });
    c.renders("extensions_all_required", [](Draft& d) {
        d.root()["extensionsRequired"] = {"EXT_mesh_gpu_instancing",
                                          "EXT_meshopt_compression",
                                          "EXT_texture_webp",
                                          "KHR_draco_mesh_compression",
                                          "KHR_lights_punctual",
                                          "KHR_materials_clearcoat",
                                          "KHR_materials_emissive_strength",
                                          "KHR_materials_ior",
                                          "KHR_materials_specular",
                                          "KHR_materials_transmission",
                                          "KHR_materials_unlit",
                                          "KHR_mesh_quantization",
                                          "KHR_texture_transform"};
    });

    const std::string whole = glb_of();
    c.fails_as_is("container_empty", "glTF", "");
    c.fails_as_is("container_no_json", "glTF", "no json at all");
    c.fails_as_is("container_truncated", "truncated", whole.substr(0, whole.size() - 5));
    c.fails_as_is("container_header_alone", "truncated", whole.substr(0, 12));
    c.fails_as_is("container_version_1", "version 1", whole.substr(0, 4) + '\1' + whole.substr(5),
                  ErrorCode::unsupported);
    c.fails_as_is("container_bad_chunk", "chunk", whole.substr(0, 16) + "XXXX" + whole.substr(20));
    c.fails_as_is("container_no_asset", "asset", glb_of([](Json& root) { root.erase("asset"); }));
    c.fails_as_is("container_version_3", "3.0", glb_of([](Json& root) { root["asset"]["version"] = "3.0"; }),
                  ErrorCode::unsupported);
    c.fails_as_is("container_deep", "deeper", "{\"asset\":{\"version\":\"2.0\"},\"extras\":" + std::string(9999, '['));
    c.fails_as_is("container_root_is_array", "glTF", "[]");
    c.fails_as_is("container_nodes_no_array", "'nodes'", glb_of([](Json& root) { root["nodes"] = 3; }));
    c.fails(
        "extension_required", "MY_extension", [](Draft& d) { d.root()["extensionsRequired"] = {"MY_extension"}; },
        ErrorCode::unsupported);

    c.fails("buffer_missing", "buffer 0", [](Draft& d) { d.buffer_uri = "none.bin"; }, ErrorCode::not_found);
    c.fails("buffer_too_short", "shorter", [](Draft& d) {
        buffer_at("data.bin")(d);
        d.beside.back().second = "short";
    });
    c.fails("buffer_is_a_folder", "folder", buffer_at("a", "a/data.bin"));
    const std::string inside = "inside the scene's folder";
    c.fails("buffer_upwards", inside, buffer_at("../data.bin"));
    c.fails("buffer_down_and_upwards", inside, buffer_at("a/../../data.bin"));
    c.fails("buffer_upwards_encoded", inside, buffer_at("%2e%2e/data.bin"));
    c.fails("buffer_upwards_half_encoded", inside, buffer_at(".%2E%2Fdata.bin"));
    c.fails("buffer_encoded_twice", "does not exist", buffer_at("%252e%252e/data.bin"), ErrorCode::not_found);
    c.fails("buffer_absolute", inside, buffer_at("/etc/passwd"));
    c.fails("buffer_file_url", inside, buffer_at("file:///etc/passwd"));
    c.fails("buffer_remote", inside, buffer_at("https://example.org/data.bin"));
    c.fails("buffer_backslash", inside, buffer_at("..\\data.bin"));
    c.fails("buffer_zero_byte", inside, buffer_at("data.bin%00"));
    c.fails("buffer_linked_outside", inside, [](Draft& d) {
        d.buffer_uri = "link.bin";
        d.link = "link.bin:/etc/hostname";
    });
    c.fails("buffer_in_linked_folder", inside, [](Draft& d) {
        d.buffer_uri = "folder/passwd";
        d.link = "folder:/etc";
    });
    c.renders("buffer_linked_inside", [](Draft& d) {
        buffer_at("link.bin")(d);
        d.link = "link.bin:data.bin";
    });
    c.fails("buffer_bad_base64", "base64",
            [](Draft& d) { d.buffer_uri = "data:application/octet-stream;base64,A?A="; });
    c.fails("buffer_data_without_comma", "data URI", [](Draft& d) { d.buffer_uri = "data:application/octet-stream"; });
    c.fails("buffer_data_too_short", "shorter",
            [](Draft& d) { d.buffer_uri = "data:application/octet-stream;base64,AAAA"; });
    c.fails("image_missing", "image 0", image_at("none.png"), ErrorCode::not_found);
    c.fails("image_upwards", inside, image_at("../p.png"));
    c.fails("image_remote", inside, image_at("http://example.org/p.png"));
    c.fails("image_linked_outside", inside, [](Draft& d) {
        image_at("link.png")(d);
        d.link = "link.png:/etc/hostname";
    });
    c.fails("buffer_without_uri_read", "outside its buffer", [](Draft& d) {
        d.b.more_buffers = Json::array({{{"byteLength", 100}}});
        d.view(0)["buffer"] = 1;
    });
    c.fails("view_outside_buffer", "buffer view 0", [](Draft& d) { d.view(0)["byteLength"] = 100000; });
    c.fails("view_without_bytes", "buffer view 0", [](Draft& d) { d.view(0)["byteLength"] = 0; });
    c.fails("view_of_no_buffer", "buffer view 0", [](Draft& d) { d.view(0)["buffer"] = 7; });
    c.fails("view_at_negative_byte", "buffer view 0", [](Draft& d) { d.view(0)["byteOffset"] = -4; });
}

}  // namespace rcs::test
