#include <cmath>

#include "gl/gl_context_impl.h"
#include "rcs/machine.h"
#include "rcs/splat.h"

namespace rcs {
namespace {

std::string text_of(GLenum name)
{
    const GLubyte* text = glGetString(name);
    return text ? reinterpret_cast<const char*>(text) : "unknown";
}

std::string limit_of(GLenum name)
{
    GLint64 value = 0;
    glGetInteger64v(name, &value);
    return std::to_string(value);
}

/// The bits that blending keeps: two records at one pixel, the second ever darker, splatted as quads until it is lost.
int measured_blend_bits(GlContext& gl)
{
    GBuffer g;
    g.width = g.height = 1;
    for (auto* plane : {&g.position_x, &g.position_y, &g.normal_x, &g.normal_y}) plane->assign(1, 0.0f);
    g.position_z.assign(1, -1.0f);
    g.normal_z.assign(1, 1.0f);
    g.instance.assign(1, 0);
    g.primitive.assign(1, 0);
    View view;
    view.width = view.height = 1;
    Record record;
    record.position = {0.0f, 0.0f, -1.0f};
    record.irradiance = glm::vec3(1.0f);
    record.spacing_radius = 1.0f;
    Record faint = record;
    ThreadPool alone(1);
    int bits = 0;
    for (int k = 1; k <= 24; ++k) {
        faint.irradiance = glm::vec3(std::ldexp(1.0f, -k));
        SplatStats stats;
        if (splat_quads(gl, {record, faint}, g, view, {}, alone, stats).weighted_r[0] != 1.0f + faint.irradiance.r)
            break;
        bits = k + 1;
    }
    return std::min(bits, 24);
}

}  // namespace

std::vector<MachineFact> describe_gl(GlContext& gl)
{
    gl.impl().make_current();
    const int bits = measured_blend_bits(gl);
    return {{"OpenGL platform", gl.platform() + (gl.software() ? ", software" : ", hardware")},
            {"OpenGL vendor", text_of(GL_VENDOR)},
            {"OpenGL renderer", gl.renderer()},
            {"OpenGL version", gl.version()},
            {"largest texture", limit_of(GL_MAX_TEXTURE_SIZE) + " px"},
            {"storage block", limit_of(GL_MAX_SHADER_STORAGE_BLOCK_SIZE) + " bytes"},
            {"colour attachments", limit_of(GL_MAX_COLOR_ATTACHMENTS)},
            {"float blending",
             std::to_string(bits) + " bits" + (bits == 24 ? " (single precision)" : ": too few for quads")}};
}

}  // namespace rcs
