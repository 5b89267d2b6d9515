#include "splat/bands.h"

#include <algorithm>
#include <initializer_list>

#include "gbuffer/shading.h"
#include "radiance/lobes.h"
#include "shared/bindings.h"

namespace rcs {
namespace {

// OpenGL 4.5 guarantees 16 MiB a shader storage block; drivers at hand give 128 MiB and more.
constexpr GLsizeiptr kMaxBlockBytes = GLsizeiptr{64} << 20;

constexpr int kLobeVectors = kHarmonics / 4;  // vec4 a pixel

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

SplatBuffer begin_splat(const std::vector<Record>& records, const GBuffer& gbuffer, const View& view,
                        const SplatSettings& options, bool glossy, GpuRecords& from, SplatStats& stats)
{
    SplatBuffer splats = make_splat_buffer(gbuffer, glossy, options.error_sums);
    splats.luminance_unit = luminance_unit(records);
    append_gpu_records(records, gbuffer.camera_position, view, options, glossy, splats.luminance_unit, from);
    for (const gpu::GpuRecord& record : from.records)
        stats.samples += static_cast<std::uint64_t>(record.pixels[2] - record.pixels[0]) *
                         static_cast<std::uint64_t>(record.pixels[3] - record.pixels[1]);
    stats.splats += from.records.size();
    return splats;
}

std::size_t most_block_bytes()
{
    GLint64 limit = 0;
    glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &limit);
    return static_cast<std::size_t>(std::clamp<GLint64>(limit, 0, kMaxBlockBytes));
}

int rows_of_band(const GBuffer& gbuffer, bool glossy, std::size_t block_bytes)
{
    const int rows = band_rows(gbuffer.width, gbuffer.height);
    if (!glossy) return rows;
    const std::size_t row_bytes = static_cast<std::size_t>(gbuffer.width) * kLobeVectors * sizeof(glm::vec4);
    return std::max(1, std::min(rows, static_cast<int>(block_bytes / row_bytes)));
}

BandBuffers make_band_buffers(const std::string& stage, int width, int rows, bool glossy, bool with_errors)
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
        buffers.framebuffer = make_framebuffer(stage, {buffers.sums.id(), buffers.counts.id(), buffers.errors.id()}, 0);
        return buffers;
    }
    buffers.glossy = make_texture(GL_RGBA32F, width, rows);
    buffers.lobes = make_buffer(static_cast<GLsizeiptr>(sizeof(glm::vec4)) * kLobeVectors * width * rows);
    buffers.framebuffer =
        make_framebuffer(stage, {buffers.sums.id(), buffers.counts.id(), buffers.errors.id(), buffers.glossy.id()}, 0);
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

RecordBlocks make_record_blocks(const GpuRecords& from, std::size_t block_bytes)
{
    const bool glossy = !from.radiance.empty();
    RecordBlocks blocks;
    blocks.most = std::clamp<std::size_t>(block_bytes / (glossy ? sizeof(gpu::GpuRadiance) : sizeof(gpu::GpuRecord)), 1,
                                          from.records.size());
    blocks.records = make_buffer(static_cast<GLsizeiptr>(blocks.most * sizeof(gpu::GpuRecord)));
    if (glossy) blocks.radiance = make_buffer(static_cast<GLsizeiptr>(blocks.most * sizeof(gpu::GpuRadiance)));
    return blocks;
}

void upload_records(const GpuRecords& from, std::size_t first, std::size_t count, const RecordBlocks& blocks)
{
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, RCS_SPLAT_BUFFER_RECORDS, blocks.records.id());
    glNamedBufferSubData(blocks.records.id(), 0, static_cast<GLsizeiptr>(count * sizeof(gpu::GpuRecord)),
                         from.records.data() + first);
    if (from.radiance.empty()) return;
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, RCS_SPLAT_BUFFER_RADIANCE, blocks.radiance.id());
    glNamedBufferSubData(blocks.radiance.id(), 0, static_cast<GLsizeiptr>(count * sizeof(gpu::GpuRadiance)),
                         from.radiance.data() + first);
}

ShaderDefines splat_variant(const BandBuffers& buffers)
{
    ShaderDefines variant;
    if (buffers.lobes.id() != 0) variant.emplace_back("RCS_SPLAT_GLOSSY");
    if (buffers.errors.id() != 0) variant.emplace_back("RCS_SPLAT_ERRORS");
    return variant;
}

void bind_inputs(const GBuffer& gbuffer, const BandBuffers& buffers)
{
    if (buffers.lobes.id() != 0) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, RCS_SPLAT_BUFFER_LOBES, buffers.lobes.id());
    glUniform2i(RCS_SPLAT_UNIFORM_IMAGE_SIZE, gbuffer.width, gbuffer.height);
    glBindTextureUnit(RCS_SPLAT_TEXTURE_POSITION, buffers.positions.id());
    glBindTextureUnit(RCS_SPLAT_TEXTURE_NORMAL, buffers.normals.id());
    glBindFramebuffer(GL_FRAMEBUFFER, buffers.framebuffer.id());
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

}  // namespace rcs
