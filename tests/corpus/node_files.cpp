#include "corpus/corpus.h"

// Nodes, scenes, cameras, lights and instances.

namespace rcs::test {
namespace {

Corpus::Change node(const char* key, const Json& value)
{
    return [=](Draft& d) { d.node[key] = value; };
}

Corpus::Change camera(const Json& value)
{
    return [=](Draft& d) { d.root()["cameras"] = Json::array({value}); };
}

Corpus::Change light(const Json& value)
{
    return [=](Draft& d) { d.light() = value; };
}

Corpus::Change more_nodes(const Json& nodes)
{
    return [=](Draft& d) { d.root()["nodes"] = nodes; };
}

/// EXT_mesh_gpu_instancing with two translations, and more attributes that `change` adds.
Corpus::Change instances(const std::function<void(Draft&, Json& attributes)>& change = {})
{
    return [=](Draft& d) {
        Json attributes = {{"TRANSLATION", d.b.add_vec3({{-0.5f, 0, 0}, {0.5f, 0, 0}})}};
        if (change) change(d, attributes);
        d.node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = attributes;
    };
}

void add_hierarchy_files(Corpus& c)
{
    c.renders("node_moved", node("translation", {0.1, 0, 0}));
    c.renders("node_turned", node("rotation", {0, 0, 0.6, 0.8}));
    c.renders("node_mirrored", node("scale", {-1, 1, 1}));
    c.renders("node_matrix", node("matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.2, 0, 0, 1}));
    c.renders("node_parent", more_nodes(Json::array({{{"children", {0}}, {"scale", {0.5, 0.5, 0.5}}}})));
    c.renders("scene_default", [](Draft& d) {
        d.root()["scenes"] = Json::array({{{"nodes", Json::array()}}, {{"nodes", {0, 1, 2}}}});
        d.root()["scene"] = 1;
    });
    c.notes("node_flat", "flattens space", more_nodes(Json::array({{{"mesh", 0}, {"scale", {1, 0, 1}}}})));
    c.fails("node_reaches_far", "farther than 1e18",
            node("matrix", {9e17, 0, 0, 0, 0, 9e17, 0, 0, 0, 0, 1, 0, 9.9e17, 0, 0, 1}));
    c.fails("camera_far_from_the_mesh", "from the middle of the meshes", [](Draft& d) {
        node("translation", {-9.9e17, 0, 0})(d);
        more_nodes(Json::array({{{"children", {1}}, {"translation", {9.9e17, 0, 0}}}}))(d);
    });
    c.fails("node_cycle", "cycle", more_nodes(Json::array({{{"children", {4}}}, {{"children", {3, 0, 1, 2}}}})));
    c.fails("node_of_two_parents", "two nodes", more_nodes(Json::array({{{"children", {0}}}, {{"children", {0}}}})));
    c.fails("node_child_unknown", "child 44", node("children", {44}));
    c.fails("node_child_is_text", "'children'", node("children", {"1"}));
    c.fails("node_mesh_unknown", "mesh 7", node("mesh", 7));
    c.fails("node_mesh_negative", "'mesh'", node("mesh", -2));
    c.fails("node_camera_unknown", "camera 7", node("camera", 7));
    c.fails("node_matrix_of_15", "'matrix'", node("matrix", std::vector<int>(15, 1)));
    c.fails("node_matrix_not_affine", "last row", node("matrix", {1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}));
    c.fails("node_matrix_huge", "entry", node("matrix", {1e30, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}));
    c.fails("node_translation_of_text", "'translation'", node("translation", {"0", 0, 0}));
    c.fails("node_rotation_of_three", "'rotation'", node("rotation", {0, 0, 1}));
    c.fails("node_rotation_of_zero", "length 0", node("rotation", {0, 0, 0, 0}));
    c.fails("node_scale_of_two", "'scale'", node("scale", {1, 1}));
    c.fails("scene_unknown", "default scene is 3", [](Draft& d) {
        d.root()["scenes"] = Json::array({{{"nodes", {0}}}});
        d.root()["scene"] = 3;
    });
    c.fails("scene_root_unknown", "node 90", [](Draft& d) { d.root()["scenes"] = Json::array({{{"nodes", {90}}}}); });
    c.fails("scene_root_is_a_child", "as a root", [](Draft& d) {
        d.root()["scenes"] = Json::array({{{"nodes", {0, 3}}}});
        d.root()["nodes"] = Json::array({{{"children", {0}}}});
    });
}

void add_camera_and_light_files(Corpus& c)
{
    c.renders(
        "camera_orthographic",
        camera({{"type", "orthographic"}, {"orthographic", {{"xmag", 2}, {"ymag", 2}, {"znear", 0.1}, {"zfar", 9}}}}));
    c.notes("camera_none", "no camera", [](Draft& d) {
        d.node["camera"] = nullptr;
        d.node.erase("camera");
        d.root()["scenes"] = Json::array({{{"nodes", {0, 2}}}});
    });
    c.notes("light_none", "no light", [](Draft& d) { d.root()["scenes"] = Json::array({{{"nodes", {0, 1}}}}); });
    c.fails("camera_fov_of_zero", "yfov",
            camera({{"type", "perspective"}, {"perspective", {{"yfov", 0}, {"znear", 1}}}}));
    c.fails("camera_fov_too_wide", "yfov",
            camera({{"type", "perspective"}, {"perspective", {{"yfov", 4}, {"znear", 1}}}}));
    c.fails("camera_fov_missing", "'yfov'", camera({{"type", "perspective"}, {"perspective", {{"znear", 1}}}}));
    c.fails("camera_without_lens", "camera description", camera({{"type", "perspective"}}));
    c.fails("camera_kind_unknown", "fisheye", camera({{"type", "fisheye"}}));
    c.fails(
        "camera_mag_of_zero", "ymag",
        camera({{"type", "orthographic"}, {"orthographic", {{"xmag", 1}, {"ymag", 0}, {"znear", 1}, {"zfar", 2}}}}));
    c.renders(
        "light_spot",
        light({{"type", "spot"}, {"intensity", 9}, {"spot", {{"innerConeAngle", 0.2}, {"outerConeAngle", 0.8}}}}));
    c.renders("light_directional", light({{"type", "directional"}, {"intensity", 2}}));
    c.renders("light_of_short_range", light({{"type", "point"}, {"range", 4}}));
    c.notes("light_cone_inside_out", "cone angles",
            light({{"type", "spot"}, {"spot", {{"innerConeAngle", 0.9}, {"outerConeAngle", 0.2}}}}));
    c.fails("light_kind_unknown", "laser", light({{"type", "laser"}}));
    c.fails("light_intensity_negative", "intensity", light({{"type", "point"}, {"intensity", -1}}));
    c.fails("light_intensity_is_text", "'intensity'", light({{"type", "point"}, {"intensity", "1"}}));
    c.fails("light_color_of_two", "'color'", light({{"type", "point"}, {"color", {1, 1}}}));
    c.fails("light_unknown", "light 6", node("extensions", {{"KHR_lights_punctual", {{"light", 6}}}}));
    c.fails("lights_no_array", "KHR_lights_punctual",
            [](Draft& d) { d.root()["extensions"]["KHR_lights_punctual"]["lights"] = 1; });
}

void add_instance_files(Corpus& c)
{
    c.renders("instances_moved", instances());
    c.renders("instances_turned", instances([](Draft& d, Json& a) {
                  a["ROTATION"] = d.b.add_accessor(d.b.add_view(raw<glm::vec4>({{0, 0, 0.6f, 0.8f}, {0, 0, 0, 1}})),
                                                   kFloat, "VEC4", 2);
                  a["SCALE"] = d.b.add_vec3({{0.5f, 0.5f, 0.5f}, {1, 1, 1}});
              }));
    c.renders("instances_turned_by_bytes", instances([](Draft& d, Json& a) {
                  a["ROTATION"] =
                      d.b.add_accessor(d.b.add_view(raw<std::int8_t>({0, 0, 0, 127, 0, 0, 127, 0})), kByte, "VEC4", 2);
                  d.accessor(a["ROTATION"])["normalized"] = true;
              }));
    c.renders("instances_with_own_attribute", instances([](Draft&, Json& a) { a["_ID"] = a["TRANSLATION"]; }));
    c.notes("instances_turned_by_zero", "length 0", instances([](Draft& d, Json& a) {
                a["ROTATION"] = d.b.add_accessor(d.b.add_view(std::string(32, '\0')), kFloat, "VEC4", 2);
            }));
    c.notes("instance_flat", "flattens space",
            instances([](Draft& d, Json& a) { a["SCALE"] = d.b.add_vec3({{0, 0, 0}, {1, 1, 1}}); }));
    c.fails("instances_of_two_counts", "elements",
            instances([](Draft& d, Json& a) { a["SCALE"] = d.b.add_vec3({{1, 1, 1}}); }));
    c.fails("instances_of_no_accessor", "EXT_mesh_gpu_instancing", instances([](Draft&, Json& a) { a["SCALE"] = 99; }));
    c.fails("instances_of_two_numbers", "TRANSLATION",
            instances([](Draft& d, Json& a) { a["TRANSLATION"] = d.b.add_vec2({{1, 1}}); }));
    c.fails("instances_of_all_memory", "outside its buffer view",
            instances([](Draft& d, Json& a) { d.accessor(a["TRANSLATION"])["count"] = 4000000000u; }));
    c.fails("instances_without_attributes", "attributes",
            node("extensions", {{"EXT_mesh_gpu_instancing", Json::object()}}));
}

}  // namespace

void add_node_files(Corpus& corpus)
{
    add_hierarchy_files(corpus);
    add_camera_and_light_files(corpus);
    add_instance_files(corpus);
}

}  // namespace rcs::test
