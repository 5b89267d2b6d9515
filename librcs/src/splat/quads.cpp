#include <algorithm>
#include <initializer_list>
#include <string>

#include "gbuffer/shading.h"
#include "gl/gl_context_impl.h"
#include "radiance/lobes.h"
#include "rcs/splat.h"
#include "shared/bindings.h"
#include "splat/gpu_records.h"

namespace rcs {
namespace {

const std::string kStage = "splatting quads";

// OpenGL 4.5 guarantees 16 MiB a shader storage block; drivers at hand give 128 MiB and more.
constexpr GLsizeiptr kMaxBlockBytes = GLsizeiptr{64} << 20;

constexpr int kLobeVectors = kHarmonics / 4;  // vec4 a pixel

/// Buffers of the width of the image and the height of a band of it.
struct BandBuffers {
    GlTexture positions, normals, sums, counts;
    GlTexture errors;  // only if they are estimated
    GlTexture glossy;  // only with glossy light, like the next
    GlBuffer lobes;
    GlFramebuffer framebuffer;
};

BandBuffers make_band_buffers(int width, int rows, bool glossy, bool with_errors)
{
    BandBuffers buffers;
    buffers.positions = make_texture(GL_RGBA32F, width, rows);
    buffers.normals = make_texture(GL_RGBA32F, width, rows);
    buffers.sums = make_texture(GL_RGBA32F, width, rows);
    buffers.counts = make_texture(GL_R32F, width, rows);
    if (with_errors) buffers.errors = make_texture(GL_RGBA32F, width, rows);
    static_assert(RCS_SPLAT_TARGET_SUMS == 0 && RCS_SPLAT_TARGET_COUNT == 1 && RCS_SPLAT_TARGET_ERROR == 2 &&
                  RCS_SPLAT_TARGET_GLOSSY == 3);
    if (!glossy) {
        buffers.framebuffer =
            make_framebuffer(kStage, {buffers.sums.id(), buffers.counts.id(), buffers.errors.id()}, 0);
        return buffers;
    }
    buffers.glossy = make_texture(GL_RGBA32F, width, rows);
    buffers.lobes = make_buffer(static_cast<GLsizeiptr>(sizeof(glm::vec4)) * kLobeVectors * width * rows);
    buffers.framebuffer =
        make_framebuffer(kStage, {buffers.sums.id(), buffers.counts.id(), buffers.errors.id(), buffers.glossy.id()}, 0);
    return buffers;
}

void upload_gbuffer(const GBuffer& gbuffer, int first_row, int rows, const BandBuffers& buffers)
{
    const std::size_t begin = static_cast<std::size_t>(first_row) * static_cast<std::size_t>(gbuffer.width);
    const std::size_t count = static_cast<std::size_t>(rows) * static_cast<std::size_t>(gbuffer.width);
    std::vector<glm::vec4> texels(count);
    for (std::size_t i = 0; i < count; ++i)
        texels[i] = glm::vec4(gbuffer.position(begin + i), gbuffer.covered(begin + i) ? 1.0f : 0.0f);
    glTextureSubImage2D(buffers.positions.id(), 0, 0, 0, gbuffer.width, rows, GL_RGBA, GL_FLOAT, texels.data());
    for (std::size_t i = 0; i < count; ++i) texels[i] = glm::vec4(gbuffer.normal(begin + i), 0.0f);
    glTextureSubImage2D(buffers.normals.id(), 0, 0, 0, gbuffer.width, rows, GL_RGBA, GL_FLOAT, texels.data());
}

void upload_lobes(const GBuffer& gbuffer, const View& view, const Shading& shading, int first_row, int rows,
                  const BandBuffers& buffers)
{
    const std::size_t begin = static_cast<std::size_t>(first_row) * static_cast<std::size_t>(gbuffer.width);
    const std::size_t count = static_cast<std::size_t>(rows) * static_cast<std::size_t>(gbuffer.width);
    std::vector<float> coefficients(count * kHarmonics);
    for (std::size_t first = 0; first < count; first += kHarmonicLanes) {
        const std::size_t lanes = std::min<std::size_t>(kHarmonicLanes, count - first);
        const Lobe* recorded[kHarmonicLanes] = {};
        glm::vec3 normals[kHarmonicLanes] = {}, outgoing[kHarmonicLanes] = {};
        for (std::size_t i = 0; i < lanes; ++i) {
            const std::size_t pixel = begin + first + i;
            if (!gbuffer.covered(pixel)) continue;
            recorded[i] = shading.recorded(pixel);
            normals[i] = gbuffer.normal(pixel);
            outgoing[i] = outgoing_at(gbuffer, view.camera, pixel);
        }
        HarmonicLanes lobes;
        evaluate_lobes(recorded, normals, outgoing, lobes);
        for (std::size_t i = 0; i < lanes; ++i)
            for (std::size_t k = 0; k < kHarmonics; ++k) coefficients[(first + i) * kHarmonics + k] = lobes[k][i];
    }
    glNamedBufferSubData(buffers.lobes.id(), 0, static_cast<GLsizeiptr>(coefficients.size() * sizeof(float)),
                         coefficients.data());
}

void set_state(GlContext::Impl& gl, const GBuffer& gbuffer, const BandBuffers& buffers, bool glossy)
{
    ShaderDefines variant;
    if (glossy) variant.emplace_back("RCS_SPLAT_GLOSSY");
    if (buffers.errors.id() != 0) variant.emplace_back("RCS_SPLAT_ERRORS");
    glUseProgram(gl.program("splat.vert", "splat.frag", variant));
    if (glossy) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, RCS_SPLAT_BUFFER_LOBES, buffers.lobes.id());
    glUniform2i(RCS_SPLAT_UNIFORM_IMAGE_SIZE, gbuffer.width, gbuffer.height);
    glBindTextureUnit(RCS_SPLAT_TEXTURE_POSITION, buffers.positions.id());
    glBindTextureUnit(RCS_SPLAT_TEXTURE_NORMAL, buffers.normals.id());
    glBindFramebuffer(GL_FRAMEBUFFER, buffers.framebuffer.id());
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    glEnable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    glBlendFunc(GL_ONE, GL_ONE);
}

/// Draws the records in their order, as many at a time as a storage block holds.
void draw_records(const GpuRecords& from, const GlBuffer& block, const GlBuffer& radiance_block,
                  std::size_t block_records)
{
    const bool glossy = !from.radiance.empty();
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, RCS_SPLAT_BUFFER_RECORDS, block.id());
    if (glossy) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, RCS_SPLAT_BUFFER_RADIANCE, radiance_block.id());
    for (std::size_t first = 0; first < from.records.size(); first += block_records) {
        const std::size_t count = std::min(block_records, from.records.size() - first);
        glNamedBufferSubData(block.id(), 0, static_cast<GLsizeiptr>(count * sizeof(gpu::GpuRecord)),
                             from.records.data() + first);
        if (glossy)
            glNamedBufferSubData(radiance_block.id(), 0, static_cast<GLsizeiptr>(count * sizeof(gpu::GpuRadiance)),
                                 from.radiance.data() + first);
        glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(count));
    }
}

/// Copies a band of a target, channel by channel, into planes of the whole image.
void read_target(int target, int first_row, int rows, int width, std::initializer_list<std::vector<float>*> planes)
{
    const std::size_t begin = static_cast<std::size_t>(first_row) * static_cast<std::size_t>(width);
    std::vector<glm::vec4> texels(static_cast<std::size_t>(rows) * static_cast<std::size_t>(width));
    glReadBuffer(GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(target));
    glReadPixels(0, 0, width, rows, GL_RGBA, GL_FLOAT, texels.data());
    int channel = 0;
    for (std::vector<float>* plane : planes) {
        for (std::size_t i = 0; i < texels.size(); ++i) (*plane)[begin + i] = texels[i][channel];
        ++channel;
    }
}

void read_back(int first_row, int rows, SplatBuffer& s)
{
    read_target(RCS_SPLAT_TARGET_SUMS, first_row, rows, s.width,
                {&s.weighted_r, &s.weighted_g, &s.weighted_b, &s.weight});
    read_target(RCS_SPLAT_TARGET_COUNT, first_row, rows, s.width, {&s.count});
    if (!s.squares.empty())
        read_target(RCS_SPLAT_TARGET_ERROR, first_row, rows, s.width, {&s.squares, &s.variance, &s.variance_of_sum});
    if (!s.glossy_r.empty())
        read_target(RCS_SPLAT_TARGET_GLOSSY, first_row, rows, s.width, {&s.glossy_r, &s.glossy_g, &s.glossy_b});
}

SplatBuffer make_splat_buffer(const GBuffer& gbuffer, bool glossy, bool with_errors)
{
    SplatBuffer splats;
    splats.width = gbuffer.width;
    splats.height = gbuffer.height;
    for (auto* plane : {&splats.weighted_r, &splats.weighted_g, &splats.weighted_b, &splats.weight, &splats.count})
        plane->resize(gbuffer.size());
    if (with_errors)
        for (auto* plane : {&splats.squares, &splats.variance, &splats.variance_of_sum}) plane->resize(gbuffer.size());
    if (glossy)
        for (auto* plane : {&splats.glossy_r, &splats.glossy_g, &splats.glossy_b}) plane->resize(gbuffer.size());
    return splats;
}

}  // namespace

SplatBuffer splat_quads(GlContext& gl, const std::vector<Record>& records, const GBuffer& gbuffer, const View& view,
                        const SplatSettings& options, SplatStats& stats, const Shading* glossy)
{
    const bool has_lobes = glossy != nullptr;
    SplatBuffer splats = make_splat_buffer(gbuffer, has_lobes, options.error_sums);
    splats.luminance_unit = luminance_unit(records);
    GpuRecords from;
    append_gpu_records(records, gbuffer.camera_position, view, options, has_lobes, splats.luminance_unit, from);
    for (const gpu::GpuRecord& record : from.records)
        stats.samples += static_cast<std::uint64_t>(record.pixels[2] - record.pixels[0]) *
                         static_cast<std::uint64_t>(record.pixels[3] - record.pixels[1]);
    stats.splats += from.records.size();

    if (gbuffer.size() == 0 || from.records.empty()) return splats;

    gl.impl().make_current();
    GLint64 block_limit = 0;
    glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &block_limit);
    const std::size_t block_bytes = static_cast<std::size_t>(std::min<GLint64>(block_limit, kMaxBlockBytes));
    int max_rows = band_rows(gbuffer.width, gbuffer.height);
    if (has_lobes) {
        const std::size_t row_bytes = static_cast<std::size_t>(gbuffer.width) * kLobeVectors * sizeof(glm::vec4);
        max_rows = std::max(1, std::min(max_rows, static_cast<int>(block_bytes / row_bytes)));
    }
    const BandBuffers buffers = make_band_buffers(gbuffer.width, max_rows, has_lobes, options.error_sums);
    const std::size_t block_records =
        std::min(block_bytes / (has_lobes ? sizeof(gpu::GpuRadiance) : sizeof(gpu::GpuRecord)), from.records.size());
    const GlBuffer block = make_buffer(static_cast<GLsizeiptr>(block_records * sizeof(gpu::GpuRecord)));
    GlBuffer radiance_block;
    if (has_lobes) radiance_block = make_buffer(static_cast<GLsizeiptr>(block_records * sizeof(gpu::GpuRadiance)));
    const GlVertexArray no_attributes = make_vertex_array();
    glBindVertexArray(no_attributes.id());
    set_state(gl.impl(), gbuffer, buffers, has_lobes);

    const float zero[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    for (int first_row = 0; first_row < gbuffer.height; first_row += max_rows) {
        const int rows = std::min(max_rows, gbuffer.height - first_row);
        upload_gbuffer(gbuffer, first_row, rows, buffers);
        if (has_lobes) upload_lobes(gbuffer, view, *glossy, first_row, rows, buffers);
        // The viewport spans the whole image; the band's rows of it fall on the target.
        glViewport(0, -first_row, gbuffer.width, gbuffer.height);
        glClearBufferfv(GL_COLOR, RCS_SPLAT_TARGET_SUMS, zero);
        glClearBufferfv(GL_COLOR, RCS_SPLAT_TARGET_COUNT, zero);
        if (options.error_sums) glClearBufferfv(GL_COLOR, RCS_SPLAT_TARGET_ERROR, zero);
        if (has_lobes) glClearBufferfv(GL_COLOR, RCS_SPLAT_TARGET_GLOSSY, zero);
        draw_records(from, block, radiance_block, block_records);
        read_back(first_row, rows, splats);
    }
    check_gl(kStage);
    return splats;
}

}  // namespace rcs
