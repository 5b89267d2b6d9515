#include <algorithm>
#include <string>

#include "gl/gl_context_impl.h"
#include "rcs/splat.h"
#include "shared/bindings.h"
#include "splat/bands.h"
#include "splat/gpu_records.h"

namespace rcs {
namespace {

const std::string kStage = "splatting quads";

void set_state(GlContext::Impl& gl, const GBuffer& gbuffer, const BandBuffers& buffers)
{
    glUseProgram(gl.program("splat.vert", "splat.frag", splat_variant(buffers)));
    bind_inputs(gbuffer, buffers);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    glEnable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    glBlendFunc(GL_ONE, GL_ONE);
}

void clear_sums(const BandBuffers& buffers)
{
    const float zero[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    glClearBufferfv(GL_COLOR, RCS_SPLAT_TARGET_SUMS, zero);
    glClearBufferfv(GL_COLOR, RCS_SPLAT_TARGET_COUNT, zero);
    if (buffers.errors.id() != 0) glClearBufferfv(GL_COLOR, RCS_SPLAT_TARGET_ERROR, zero);
    if (buffers.glossy.id() != 0) glClearBufferfv(GL_COLOR, RCS_SPLAT_TARGET_GLOSSY, zero);
}

/// Draws the records in their order, as many at a time as a storage block holds.
void draw_records(const GpuRecords& from, const RecordBlocks& blocks)
{
    for (std::size_t first = 0; first < from.records.size(); first += blocks.most) {
        const std::size_t count = std::min(blocks.most, from.records.size() - first);
        upload_records(from, first, count, blocks);
        glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(count));
    }
}

}  // namespace

SplatBuffer splat_quads(GlContext& gl, const std::vector<Record>& records, const GBuffer& gbuffer, const View& view,
                        const SplatSettings& options, ThreadPool& pool, SplatStats& stats, const Shading* glossy)
{
    const bool has_lobes = glossy != nullptr;
    GpuRecords from;
    SplatBuffer splats = begin_splat({records, gbuffer, view, options, has_lobes}, pool, from, stats);
    if (gbuffer.size() == 0 || from.records.empty()) return splats;

    gl.impl().make_current();
    const std::size_t block_bytes = most_block_bytes();
    const int max_rows = rows_of_band(gbuffer, has_lobes, block_bytes);
    const BandBuffers buffers = make_band_buffers(kStage, gbuffer.width, max_rows, has_lobes, options.error_sums);
    const RecordBlocks blocks = make_record_blocks(from, block_bytes);
    const GlVertexArray no_attributes = make_vertex_array();
    glBindVertexArray(no_attributes.id());
    for (int first_row = 0; first_row < gbuffer.height; first_row += max_rows) {
        const int rows = std::min(max_rows, gbuffer.height - first_row);
        upload_gbuffer(gbuffer, first_row, rows, buffers, pool);
        if (has_lobes) lay_lobes(gl, {gbuffer, view, *glossy}, first_row, rows, buffers, pool);
        set_state(gl.impl(), gbuffer, buffers);
        // The viewport spans the whole image; the band's rows of it fall on the target.
        glViewport(0, -first_row, gbuffer.width, gbuffer.height);
        clear_sums(buffers);
        draw_records(from, blocks);
        read_back(first_row, rows, pool, splats);
    }
    check_gl(kStage);
    return splats;
}

}  // namespace rcs
