#include "gbuffer/visibility.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <glm/gtc/type_ptr.hpp>

#include "gl/gl_context_impl.h"
#include "shared/bindings.h"

namespace rcs {
namespace {

const std::string kStage = "rasterising the scene";

/// Distances along the view direction between which the scene lies.
struct DepthRange {
    double near = std::numeric_limits<double>::infinity();
    double far = -std::numeric_limits<double>::infinity();
};

DepthRange depth_range(const Bounds& bounds, const glm::dmat4& view_from_world)
{
    DepthRange range;
    if (!(bounds.min.x <= bounds.max.x)) return range;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec4 point((corner & 1) != 0 ? bounds.max.x : bounds.min.x,
                               (corner & 2) != 0 ? bounds.max.y : bounds.min.y,
                               (corner & 4) != 0 ? bounds.max.z : bounds.min.z, 1.0);
        const double depth = -(view_from_world * point).z;
        range.near = std::min(range.near, depth);
        range.far = std::max(range.far, depth);
    }
    return range;
}

/// Reversed depth without a far plane: near / depth, whose float keeps the same relative precision at
/// any distance. With depth clamping the near plane cuts nothing off; its distance only has to be
/// smaller than any that matters, and the depth at `far` has to stay a normal float.
glm::dvec4 perspective_depth_row(const DepthRange& range) { return {0.0, 0.0, 0.0, range.far * 0x1p-40}; }

/// Reversed linear depth, 1 at the near plane to 0 at the far one, which enclose the scene with a margin;
/// but no nearer than the camera's plane, where its view begins.
glm::dvec4 parallel_depth_row(const DepthRange& range)
{
    const double margin = 1e-3 * range.far;  // far above float rounding, and > 0 for a flat scene
    const double near = std::max(0.0, range.near - margin);
    const double far = range.far + margin;
    return {0.0, 0.0, 1.0 / (far - near), far / (far - near)};
}

/// Maps view space so that the centre of pixel (i, j) of the target shows image position
/// (i, j) + pixel_offset, with row 0 of the image in row 0 of the target (so y is flipped).
glm::dmat4 clip_from_view(const View& view, const DepthRange& range)
{
    const bool perspective = view.camera.projection == Projection::perspective;
    const ImagePlane plane = image_plane(view);
    const glm::dvec2 size(view.width, view.height);
    const glm::dvec4 w_row = perspective ? glm::dvec4(0.0, 0.0, -1.0, 0.0) : glm::dvec4(0.0, 0.0, 0.0, 1.0);
    const glm::dvec2 shift = 2.0 * (plane.axis - 0.5 * size + 0.5 - view.pixel_offset) / size;
    const glm::dvec2 scale = 2.0 / (plane.pixel * size);
    const glm::dvec4 x_row = glm::dvec4(scale.x, 0.0, 0.0, 0.0) + shift.x * w_row;
    const glm::dvec4 y_row = glm::dvec4(0.0, -scale.y, 0.0, 0.0) + shift.y * w_row;
    const glm::dvec4 z_row = perspective ? perspective_depth_row(range) : parallel_depth_row(range);
    return glm::transpose(glm::dmat4(x_row, y_row, z_row, w_row));
}

/// All meshes of a scene in one vertex and one index buffer.
struct Geometry {
    struct Range {
        GLint first_vertex = 0;
        std::size_t first_index = 0;
    };
    std::vector<Range> meshes;
    GlBuffer vertices, indices;
    GlVertexArray vertex_array;
};

Geometry upload_geometry(const Scene& scene)
{
    Geometry geometry;
    std::size_t vertices = 0;
    std::size_t indices = 0;
    for (const Mesh& mesh : scene.meshes) {
        geometry.meshes.push_back({static_cast<GLint>(vertices), indices});
        vertices += mesh.positions.size();
        indices += mesh.triangles.size() * 3;
    }
    geometry.vertices = make_buffer(static_cast<GLsizeiptr>(vertices * sizeof(glm::vec3)));
    geometry.indices = make_buffer(static_cast<GLsizeiptr>(indices * sizeof(GLuint)));
    for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
        const Mesh& mesh = scene.meshes[m];
        const Geometry::Range& range = geometry.meshes[m];
        const std::size_t first_byte = static_cast<std::size_t>(range.first_vertex) * sizeof(glm::vec3);
        glNamedBufferSubData(geometry.vertices.id(), static_cast<GLintptr>(first_byte),
                             static_cast<GLsizeiptr>(mesh.positions.size() * sizeof(glm::vec3)), mesh.positions.data());
        glNamedBufferSubData(geometry.indices.id(), static_cast<GLintptr>(range.first_index * sizeof(GLuint)),
                             static_cast<GLsizeiptr>(mesh.triangles.size() * sizeof(glm::uvec3)),
                             mesh.triangles.data());
    }
    geometry.vertex_array = make_vertex_array();
    const GLuint id = geometry.vertex_array.id();
    glVertexArrayVertexBuffer(id, 0, geometry.vertices.id(), 0, sizeof(glm::vec3));
    glVertexArrayElementBuffer(id, geometry.indices.id());
    glEnableVertexArrayAttrib(id, RCS_GBUFFER_ATTRIBUTE_POSITION);
    glVertexArrayAttribFormat(id, RCS_GBUFFER_ATTRIBUTE_POSITION, 3, GL_FLOAT, GL_FALSE, 0);
    glVertexArrayAttribBinding(id, RCS_GBUFFER_ATTRIBUTE_POSITION, 0);
    check_gl("uploading the scene's triangles");
    return geometry;
}

void set_state(GlContext::Impl& gl, const Geometry& geometry, const GlFramebuffer& framebuffer, bool perspective)
{
    glUseProgram(gl.program("gbuffer.vert", "gbuffer.frag"));
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.id());
    glBindVertexArray(geometry.vertex_array.id());
    glDisable(GL_BLEND);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    // A parallel view ends at the camera's plane, where its near plane lies at the latest.
    if (perspective)
        glEnable(GL_DEPTH_CLAMP);
    else
        glDisable(GL_DEPTH_CLAMP);
    glCullFace(GL_BACK);
}

void draw_instances(const Scene& scene, const Geometry& geometry, const glm::dmat4& clip_from_world)
{
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const Instance& instance = scene.instances[i];
        const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
        const Geometry::Range& range = geometry.meshes[static_cast<std::size_t>(instance.mesh)];
        if (scene.materials[static_cast<std::size_t>(mesh.material)].double_sided)
            glDisable(GL_CULL_FACE);
        else
            glEnable(GL_CULL_FACE);
        // The flipped y axis turns counter-clockwise into clockwise, and so does a mirror.
        const bool mirrored = glm::determinant(glm::dmat3(instance.world_from_object)) < 0.0;
        glFrontFace(mirrored ? GL_CCW : GL_CW);
        const glm::mat4 clip_from_object(clip_from_world * instance.world_from_object);
        glUniformMatrix4fv(RCS_GBUFFER_UNIFORM_CLIP_FROM_OBJECT, 1, GL_FALSE, glm::value_ptr(clip_from_object));
        glUniform1ui(RCS_GBUFFER_UNIFORM_INSTANCE, static_cast<GLuint>(i));
        const void* first_index = reinterpret_cast<const void*>(range.first_index * sizeof(GLuint));
        glDrawElementsBaseVertex(GL_TRIANGLES, static_cast<GLsizei>(mesh.triangles.size() * 3), GL_UNSIGNED_INT,
                                 first_index, range.first_vertex);
    }
}

void read_back(int width, int rows, int first_row, Visibility& visibility)
{
    const std::size_t first_pixel = static_cast<std::size_t>(first_row) * static_cast<std::size_t>(width);
    std::vector<glm::uvec2> ids(static_cast<std::size_t>(width) * static_cast<std::size_t>(rows));
    glReadBuffer(GL_COLOR_ATTACHMENT0);
    glReadPixels(0, 0, width, rows, GL_RG_INTEGER, GL_UNSIGNED_INT, ids.data());
    for (std::size_t i = 0; i < ids.size(); ++i) {
        visibility.instance[first_pixel + i] = ids[i].x;
        visibility.primitive[first_pixel + i] = ids[i].y;
    }
}

}  // namespace

Visibility render_visibility(GlContext& gl, const Scene& scene, const View& view)
{
    constexpr GLuint kNone = 0xffffffffu;
    const std::size_t pixels = static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
    Visibility visibility;
    visibility.instance.assign(pixels, kNone);
    visibility.primitive.assign(pixels, kNone);
    const glm::dmat4 view_from_world = glm::inverse(view.camera.world_from_view);
    const DepthRange range = depth_range(bounds_of(scene), view_from_world);
    if (pixels == 0 || !(range.far > 0.0)) return visibility;  // nothing in front of the camera
    const glm::dmat4 clip_from_world = clip_from_view(view, range) * view_from_world;

    gl.impl().make_current();
    const int max_rows = band_rows(view.width, view.height);
    const Geometry geometry = upload_geometry(scene);
    const GlTexture ids = make_texture(GL_RG32UI, view.width, max_rows);
    const GlTexture depth = make_texture(GL_DEPTH_COMPONENT32F, view.width, max_rows);
    const GlFramebuffer framebuffer = make_framebuffer(kStage, {ids.id()}, depth.id());
    set_state(gl.impl(), geometry, framebuffer, view.camera.projection == Projection::perspective);

    const GLuint none[4] = {kNone, kNone, kNone, kNone};
    const float farthest = 0.0f;
    for (int first_row = 0; first_row < view.height; first_row += max_rows) {
        const int rows = std::min(max_rows, view.height - first_row);
        // The viewport spans the whole image; the band's rows of it fall on the target.
        glViewport(0, -first_row, view.width, view.height);
        glClearBufferuiv(GL_COLOR, RCS_GBUFFER_TARGET_IDS, none);
        glClearBufferfv(GL_DEPTH, 0, &farthest);
        draw_instances(scene, geometry, clip_from_world);
        read_back(view.width, rows, first_row, visibility);
    }
    check_gl(kStage);
    return visibility;
}

}  // namespace rcs
