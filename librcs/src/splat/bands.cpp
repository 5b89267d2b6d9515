#include "splat/bands.h"

#include <algorithm>
#include <initializer_list>

#include "gbuffer/shading.h"
#include "gl/gl_context_impl.h"
#include "radiance/lobes.h"
#include "shared/bindings.h"

namespace rcs {
namespace {

// OpenGL 4.5 guarantees 16 MiB a shader storage block; drivers at hand give 128 MiB and more.
constexpr GLsizeiptr kMaxBlockBytes = GLsizeiptr{64} << 20;

constexpr int kLobeVectors = kHarmonics / 4;  // vec4 a pixel
constexpr std::size_t kPixelsAtATime = 4096;

/// Pixels of a band, in the whole image.
struct BandPixels {
    int width, first_row, rows;

    std::size_t begin() const { return static_cast<std::size_t>(first_row) * static_cast<std::size_t>(width); }
    std::size_t size() const { return static_cast<std::size_t>(rows) * static_cast<std::size_t>(width); }
};

/// Copies a band of a target, channel by channel, into planes of the whole image.
/// @param texels  memory to do it in
void read_target(int target, const BandPixels& band, std::initializer_list<std::vector<float>*> planes,
                 std::vector<glm::vec4>& texels, ThreadPool& pool)
{
    glReadBuffer(GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(target));
    if (planes.size() == 1) {
        glReadPixels(0, 0, band.width, band.rows, GL_RED, GL_FLOAT, (*planes.begin())->data() + band.begin());
        return;
    }
    texels.resize(band.size());
    glReadPixels(0, 0, band.width, band.rows, GL_RGBA, GL_FLOAT, texels.data());
    pool.parallel_for(texels.size(), kPixelsAtATime, [&](std::size_t begin, std::size_t end, int) {
        int channel = 0;
        for (std::vector<float>* plane : planes) {
            float* to = plane->data() + band.begin();
            for (std::size_t i = begin; i < end; ++i) to[i] = texels[i][channel];
            ++channel;
        }
    });
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

SplatBuffer begin_splat(const SplatTask& task, ThreadPool& pool, GpuRecords& from, SplatStats& stats)
{
    SplatBuffer splats = make_splat_buffer(task.gbuffer, task.glossy, task.options.error_sums);
    splats.luminance_unit = luminance_unit(task.records);
    from = make_gpu_records(task.records, task.gbuffer.camera_position, task.view, task.options, task.glossy,
                            splats.luminance_unit, pool);
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
    buffers.kinds = make_texture(GL_RGBA32F, width, rows);
    buffers.fits = make_buffer(sizeof(gpu::GpuLobeFits));
    glNamedBufferSubData(buffers.fits.id(), 0, sizeof(gpu::GpuLobeFits), &device_lobe_fits());
    buffers.framebuffer =
        make_framebuffer(stage, {buffers.sums.id(), buffers.counts.id(), buffers.errors.id(), buffers.glossy.id()}, 0);
    return buffers;
}

void upload_gbuffer(const GBuffer& gbuffer, int first_row, int rows, const BandBuffers& buffers, ThreadPool& pool)
{
    const BandPixels band{gbuffer.width, first_row, rows};
    std::vector<glm::vec4> texels(band.size());
    const auto upload = [&](const GlTexture& to, const auto& texel_of) {
        pool.parallel_for(band.size(), kPixelsAtATime, [&](std::size_t begin, std::size_t end, int) {
            for (std::size_t i = begin; i < end; ++i) texels[i] = texel_of(band.begin() + i);
        });
        glTextureSubImage2D(to.id(), 0, 0, 0, band.width, band.rows, GL_RGBA, GL_FLOAT, texels.data());
    };
    upload(buffers.positions,
           [&](std::size_t pixel) { return glm::vec4(gbuffer.position(pixel), gbuffer.covered(pixel) ? 1.0f : 0.0f); });
    upload(buffers.normals, [&](std::size_t pixel) { return glm::vec4(gbuffer.normal(pixel), 0.0f); });
}

void lay_lobes(GlContext& gl, const LobedView& lobed, int first_row, int rows, const BandBuffers& buffers,
               ThreadPool& pool)
{
    const BandPixels band{lobed.gbuffer.width, first_row, rows};
    std::vector<glm::vec4> kinds(band.size());
    pool.parallel_for(band.size(), kPixelsAtATime, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i) {
            const std::size_t pixel = band.begin() + i;
            kinds[i] = device_lobe(lobed.gbuffer.covered(pixel) ? lobed.shading.recorded(pixel) : nullptr);
        }
    });
    glTextureSubImage2D(buffers.kinds.id(), 0, 0, 0, band.width, band.rows, GL_RGBA, GL_FLOAT, kinds.data());
    glUseProgram(gl.impl().compute_program("lobes.comp", {}));
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, RCS_LOBES_BUFFER_FITS, buffers.fits.id());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, RCS_SPLAT_BUFFER_LOBES, buffers.lobes.id());
    glBindTextureUnit(RCS_SPLAT_TEXTURE_POSITION, buffers.positions.id());
    glBindTextureUnit(RCS_SPLAT_TEXTURE_NORMAL, buffers.normals.id());
    glBindTextureUnit(RCS_LOBES_TEXTURE_LOBE, buffers.kinds.id());
    glUniform2i(RCS_SPLAT_UNIFORM_IMAGE_SIZE, band.width, band.rows);
    const Camera& camera = lobed.view.camera;
    const bool is_parallel = camera.projection == Projection::orthographic;
    const glm::vec3 toward = is_parallel ? parallel_outgoing(camera) : glm::vec3(0.0f);
    glUniform4f(RCS_LOBES_UNIFORM_TOWARD, toward.x, toward.y, toward.z, is_parallel ? 1.0f : 0.0f);
    const auto groups = [](int pixels) {
        return static_cast<GLuint>((pixels + RCS_LOBES_GROUP - 1) / RCS_LOBES_GROUP);
    };
    glDispatchCompute(groups(band.width), groups(band.rows), 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
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

void read_back(int first_row, int rows, ThreadPool& pool, SplatBuffer& s)
{
    const BandPixels band{s.width, first_row, rows};
    std::vector<glm::vec4> texels;
    const auto read = [&](int target, std::initializer_list<std::vector<float>*> planes) {
        read_target(target, band, planes, texels, pool);
    };
    read(RCS_SPLAT_TARGET_SUMS, {&s.weighted_r, &s.weighted_g, &s.weighted_b, &s.weight});
    read(RCS_SPLAT_TARGET_COUNT, {&s.count});
    if (!s.squares.empty()) read(RCS_SPLAT_TARGET_ERROR, {&s.squares, &s.variance, &s.variance_of_sum});
    if (!s.glossy_r.empty()) read(RCS_SPLAT_TARGET_GLOSSY, {&s.glossy_r, &s.glossy_g, &s.glossy_b});
}

}  // namespace rcs
