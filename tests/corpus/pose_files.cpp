#include <limits>

#include "corpus/corpus.h"

// Skins, morph targets and animations.

namespace rcs::test {
namespace {

const glm::mat4 kIdentity(1.0f);

/// Joints are nodes 3 and 4; every vertex hangs on both alike.
Corpus::Change skin(const std::function<void(Draft&)>& change = {})
{
    return [=](Draft& d) {
        d.attributes()["JOINTS_0"] =
            d.b.add_accessor(d.b.add_view(raw(std::vector<glm::u8vec4>(4, {0, 1, 0, 0}))), kUnsignedByte, "VEC4", 4);
        d.attributes()["WEIGHTS_0"] =
            d.b.add_accessor(d.b.add_view(raw(std::vector<glm::vec4>(4, {0.5f, 0.5f, 0, 0}))), kFloat, "VEC4", 4);
        const int matrices = d.b.add_accessor(d.b.add_view(raw<glm::mat4>({kIdentity, kIdentity})), kFloat, "MAT4", 2);
        d.root()["skins"] = Json::array({{{"joints", {3, 4}}, {"inverseBindMatrices", matrices}}});
        d.root()["nodes"] = Json::array({{{"translation", {0.2, 0, 0}}}, {{"rotation", {0, 0, 0.6, 0.8}}}});
        d.node["skin"] = 0;
        if (change) change(d);
    };
}

Json& first_skin(Draft& d) { return d.root()["skins"][0]; }

/// One target that lifts all vertices, in effect by half.
Corpus::Change morph(const std::function<void(Draft&)>& change = {})
{
    return [=](Draft& d) {
        d.primitive["targets"] = Json::array({{{"POSITION", d.b.add_vec3(std::vector<glm::vec3>(4, {0, 0.2f, 0}))}}});
        d.mesh["weights"] = {0.5};
        if (change) change(d);
    };
}

/// Animates the quad's node from time 0 to 1 and asks for time 0.25.
Corpus::Change animation(const char* path, const std::vector<float>& values, const char* interpolation = "LINEAR",
                         const std::function<void(Draft&)>& change = {})
{
    return [=](Draft& d) {
        const std::size_t length = path == std::string("rotation") ? 4 : path == std::string("weights") ? 1 : 3;
        const char* shape = length == 4 ? "VEC4" : length == 1 ? "SCALAR" : "VEC3";
        const int input = d.b.add_accessor(d.b.add_view(raw<float>({0, 1})), kFloat, "SCALAR", 2);
        const int output = d.b.add_accessor(d.b.add_view(raw(values)), kFloat, shape, values.size() / length);
        d.root()["animations"] = Json::array(
            {{{"name", "move"},
              {"channels", Json::array({{{"sampler", 0}, {"target", {{"node", 0}, {"path", path}}}}})},
              {"samplers", Json::array({{{"input", input}, {"output", output}, {"interpolation", interpolation}}})}}});
        d.time = 0.25;
        if (change) change(d);
    };
}

Json& first_animation(Draft& d) { return d.root()["animations"][0]; }

Corpus::Change moved(const std::function<void(Draft&)>& change)
{
    return animation("translation", {0, 0, 0, 1, 0, 0}, "LINEAR", change);
}

void add_skin_files(Corpus& c)
{
    c.renders("skin", skin());
    c.renders("skin_without_matrices", skin([](Draft& d) { first_skin(d).erase("inverseBindMatrices"); }));
    c.renders("skin_of_eight_weights", skin([](Draft& d) {
                  d.attributes()["JOINTS_1"] = d.attributes()["JOINTS_0"];
                  d.attributes()["WEIGHTS_1"] = d.attributes()["WEIGHTS_0"];
              }));
    c.renders("skin_of_shorts_and_bytes", skin([](Draft& d) {
                  d.attributes()["JOINTS_0"] = d.b.add_accessor(
                      d.b.add_view(raw(std::vector<glm::u16vec4>(4, {0, 1, 0, 0}))), kUnsignedShort, "VEC4", 4);
                  const int weights = d.b.add_accessor(d.b.add_view(raw(std::vector<glm::u8vec4>(4, {128, 127, 0, 0}))),
                                                       kUnsignedByte, "VEC4", 4);
                  d.accessor(weights)["normalized"] = true;
                  d.attributes()["WEIGHTS_0"] = weights;
              }));
    c.notes("skin_without_joint_attribute", "without joints and weights",
            skin([](Draft& d) { d.attributes().erase("JOINTS_0"); }));
    c.notes("skin_weights_of_zero", "skin weights", skin([](Draft& d) {
                d.attributes()["WEIGHTS_0"] = d.b.add_accessor(d.b.add_view(std::string(64, '\0')), kFloat, "VEC4", 4);
            }));
    c.fails("skin_unknown", "skin 4", skin([](Draft& d) { d.node["skin"] = 4; }));
    c.fails("skin_without_joints", "'joints'", skin([](Draft& d) { first_skin(d).erase("joints"); }));
    c.fails("skin_of_no_joints", "0 joints", skin([](Draft& d) { first_skin(d)["joints"] = Json::array(); }));
    c.fails("skin_joint_unknown", "joint 70", skin([](Draft& d) { first_skin(d)["joints"] = {70, 4}; }));
    c.fails("skin_joint_outside_scene", "no node of the scene",
            skin([](Draft& d) { d.root()["scenes"] = Json::array({{{"nodes", {0, 1, 2, 3}}}}); }));
    c.fails("skin_of_one_matrix", "inverse bind matrices",
            skin([](Draft& d) { d.accessor(first_skin(d)["inverseBindMatrices"])["count"] = 1; }));
    // The joints place the mesh: without weights that matrix is all there is of the skin.
    c.fails("skin_of_a_huge_matrix", "joint 0 with its inverse bind matrix", skin([](Draft& d) {
                const float huge[] = {1e30f};
                const std::size_t view = d.accessor(first_skin(d)["inverseBindMatrices"])["bufferView"];
                d.b.binary.replace(d.view(static_cast<int>(view))["byteOffset"].get<std::size_t>() + 12 * sizeof(float),
                                   sizeof(huge), reinterpret_cast<const char*>(huge), sizeof(huge));
            }));
    c.fails("skin_matrices_are_vectors", "MAT4", skin([](Draft& d) { first_skin(d)["inverseBindMatrices"] = 0; }));
    c.fails("skin_joint_index_too_large", "names joint", skin([](Draft& d) { first_skin(d)["joints"] = {3}; }));
    c.fails("skin_too_few_weights", "WEIGHTS_0",
            skin([](Draft& d) { d.accessor(d.attributes()["WEIGHTS_0"])["count"] = 3; }));
    c.fails("skin_joints_of_two", "JOINTS_0", skin([](Draft& d) { d.attributes()["JOINTS_0"] = 1; }));
}

void add_morph_files(Corpus& c)
{
    c.renders("morph", morph());
    c.renders("morph_at_rest", morph([](Draft& d) { d.mesh.erase("weights"); }));
    c.renders("morph_weights_of_node", morph([](Draft& d) { d.node["weights"] = {1}; }));
    c.renders("morph_sparse", morph([](Draft& d) {
                  const int views[] = {d.b.add_view(raw<std::uint8_t>({3})),
                                       d.b.add_view(raw<glm::vec3>({{0, 0.5f, 0}}))};
                  d.primitive["targets"][0]["POSITION"] =
                      d.b.add("accessors", {{"componentType", kFloat},
                                            {"type", "VEC3"},
                                            {"count", 4},
                                            {"sparse",
                                             {{"count", 1},
                                              {"indices", {{"bufferView", views[0]}, {"componentType", kUnsignedByte}}},
                                              {"values", {{"bufferView", views[1]}}}}}});
              }));
    c.renders("morph_normals", morph([](Draft& d) {
                  d.attributes()["NORMAL"] = d.b.add_vec3(std::vector<glm::vec3>(4, {0, 0, 1}));
                  d.primitive["targets"][0]["NORMAL"] = d.b.add_vec3(std::vector<glm::vec3>(4, {0.5f, 0, 0}));
              }));
    c.fails("morph_of_two_weights", "weights", morph([](Draft& d) { d.mesh["weights"] = {0.5, 0.5}; }));
    c.fails("morph_of_too_few", "morph target 0",
            morph([](Draft& d) { d.primitive["targets"][0]["POSITION"] = d.b.add_vec3({{0, 0, 1}}); }));
    c.fails("morph_of_no_accessor", "accessor 99", morph([](Draft& d) { d.primitive["targets"][0]["POSITION"] = 99; }));
    c.fails("morph_targets_no_objects", "'targets'", morph([](Draft& d) { d.primitive["targets"] = {0}; }));
    c.fails("morph_weights_are_text", "'weights'", morph([](Draft& d) { d.mesh["weights"] = {"1"}; }));
    c.fails("morph_to_infinity", "as posed", morph([](Draft& d) { d.mesh["weights"] = {1e30}; }));
}

void add_animation_files(Corpus& c)
{
    c.renders("animation_translation", animation("translation", {0, 0, 0, 1, 0, 0}));
    c.renders("animation_rotation", animation("rotation", {0, 0, 0, 1, 0, 0, 0.6f, 0.8f}));
    c.renders("animation_scale", animation("scale", {1, 1, 1, 2, 2, 2}));
    c.renders("animation_step", animation("translation", {0, 0, 0, 9, 0, 0}, "STEP"));
    c.renders("animation_cubic", animation("translation", std::vector<float>(18, 0.1f), "CUBICSPLINE"));
    c.renders("animation_weights", [](Draft& d) {
        morph()(d);
        animation("weights", {0, 1})(d);
    });
    c.renders("animation_of_nothing",
              moved([](Draft& d) { first_animation(d)["channels"][0]["target"].erase("node"); }));
    c.notes("animation_at_rest", "rest pose", moved([](Draft& d) { d.time.reset(); }));
    c.notes("animation_missing", "no animation", [](Draft& d) { d.time = 1.0; });
    c.notes("animation_twice", "earlier animation",
            moved([](Draft& d) { d.root()["animations"].push_back(Json(first_animation(d))); }));
    c.notes("animation_path_unknown", "channels of a kind",
            moved([](Draft& d) { first_animation(d)["channels"][0]["target"]["path"] = "pointer"; }));
    c.fails("animation_times_descend", "ascend", moved([](Draft& d) {
                first_animation(d)["samplers"][0]["input"] =
                    d.b.add_accessor(d.b.add_view(raw<float>({1, 0})), kFloat, "SCALAR", 2);
            }));
    c.fails("animation_of_too_few_values", "keyframes", animation("translation", {0, 0, 0}));
    c.fails("animation_cubic_without_tangents", "keyframes",
            animation("translation", {0, 0, 0, 1, 0, 0}, "CUBICSPLINE"));
    c.fails("animation_interpolation_unknown", "interpolation", animation("translation", {0, 0, 0, 1, 0, 0}, "BEZIER"));
    c.fails("animation_value_infinite", "not finite", animation("translation", {0, 0, 0, HUGE_VALF, 0, 0}));
    c.fails("animation_rotation_of_zero", "length 0", animation("rotation", std::vector<float>(8, 0.0f), "STEP"));
    c.fails("animation_node_unknown", "node 40",
            moved([](Draft& d) { first_animation(d)["channels"][0]["target"]["node"] = 40; }));
    c.fails("animation_sampler_unknown", "sampler 4",
            moved([](Draft& d) { first_animation(d)["channels"][0]["sampler"] = 4; }));
    c.fails("animation_sampler_without_input", "'input'",
            moved([](Draft& d) { first_animation(d)["samplers"][0].erase("input"); }));
    c.fails("animation_without_path", "'path'",
            moved([](Draft& d) { first_animation(d)["channels"][0]["target"].erase("path"); }));
    c.fails("animation_without_channels", "'channels'", moved([](Draft& d) { first_animation(d).erase("channels"); }));
    c.fails("animation_input_is_vectors", "SCALAR",
            moved([](Draft& d) { first_animation(d)["samplers"][0]["input"] = 0; }));
    c.fails("animation_of_a_matrix", "has a matrix",
            moved([](Draft& d) { d.node["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; }));
}

}  // namespace

void add_pose_files(Corpus& corpus)
{
    add_skin_files(corpus);
    add_morph_files(corpus);
    add_animation_files(corpus);
}

}  // namespace rcs::test
