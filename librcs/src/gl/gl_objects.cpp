#include "gl/gl_objects.h"

#include <algorithm>
#include <vector>

#include "rcs/error.h"
#include "util/counters.h"

namespace rcs {
namespace {

const char* gl_error_name(GLenum error)
{
    switch (error) {
        case GL_INVALID_ENUM:
            return "GL_INVALID_ENUM";
        case GL_INVALID_VALUE:
            return "GL_INVALID_VALUE";
        case GL_INVALID_OPERATION:
            return "GL_INVALID_OPERATION";
        case GL_INVALID_FRAMEBUFFER_OPERATION:
            return "GL_INVALID_FRAMEBUFFER_OPERATION";
        case GL_OUT_OF_MEMORY:
            return "GL_OUT_OF_MEMORY";
        case GL_CONTEXT_LOST:
            return "GL_CONTEXT_LOST";
        default:
            return "an unknown GL error";
    }
}

std::uint64_t texel_bytes(GLenum internal_format)
{
    switch (internal_format) {
        case GL_RGBA32F:
            return 16;
        case GL_RG32UI:
            return 8;
        case GL_R32F:
        case GL_DEPTH_COMPONENT32F:
            return 4;
        default:
            throw Error(ErrorCode::internal, "a texture format of unknown size");
    }
}

// A band of 4 Mi pixels holds a 2048 x 2048 image whole, and keeps the widest set of buffers
// (52 bytes a pixel, splatting) near 200 MiB.
constexpr int kBandPixels = 4 << 20;

}  // namespace

void check_gl(const std::string& stage)
{
    const GLenum first = glGetError();
    if (first == GL_NO_ERROR) return;
    // Each call clears one flag; a lost context reports for ever, hence the bound.
    for (int i = 0; i < 16 && glGetError() != GL_NO_ERROR; ++i) continue;
    const ErrorCode code = first == GL_OUT_OF_MEMORY ? ErrorCode::out_of_memory : ErrorCode::gl_unavailable;
    throw Error(code, stage + ": OpenGL reported " + gl_error_name(first));
}

GlTexture make_texture(GLenum internal_format, int width, int height)
{
    GLuint id = 0;
    glCreateTextures(GL_TEXTURE_2D, 1, &id);
    GlTexture texture(id);
    tally(Count::gl_bytes,
          texel_bytes(internal_format) * static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height));
    glTextureStorage2D(id, 1, internal_format, width, height);
    glTextureParameteri(id, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(id, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

GlBuffer make_buffer(GLsizeiptr bytes)
{
    GLuint id = 0;
    glCreateBuffers(1, &id);
    GlBuffer buffer(id);
    tally(Count::gl_bytes, static_cast<std::uint64_t>(bytes));
    glNamedBufferStorage(id, std::max<GLsizeiptr>(bytes, 1), nullptr, GL_DYNAMIC_STORAGE_BIT);
    return buffer;
}

GlFramebuffer make_framebuffer(const std::string& stage, std::initializer_list<GLuint> colors, GLuint depth)
{
    GLuint id = 0;
    glCreateFramebuffers(1, &id);
    GlFramebuffer framebuffer(id);
    std::vector<GLenum> attachments;
    for (const GLuint color : colors) {
        const GLenum attachment = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(attachments.size());
        attachments.push_back(color != 0 ? attachment : GL_NONE);
        if (color != 0) glNamedFramebufferTexture(id, attachment, color, 0);
    }
    if (depth != 0) glNamedFramebufferTexture(id, GL_DEPTH_ATTACHMENT, depth, 0);
    glNamedFramebufferDrawBuffers(id, static_cast<GLsizei>(attachments.size()), attachments.data());
    check_gl(stage);  // an allocation that failed is the better message
    if (glCheckNamedFramebufferStatus(id, GL_DRAW_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        throw Error(ErrorCode::gl_unavailable, stage + ": the driver cannot draw to these buffers");
    return framebuffer;
}

GlVertexArray make_vertex_array()
{
    GLuint id = 0;
    glCreateVertexArrays(1, &id);
    return GlVertexArray(id);
}

int band_rows(int width, int height)
{
    GLint texture_limit = 0;
    GLint viewport_limit[2] = {0, 0};
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &texture_limit);
    glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport_limit);
    const int max_width = std::min(texture_limit, viewport_limit[0]);
    const int max_height = viewport_limit[1];
    if (width > max_width || height > max_height)
        throw Error(ErrorCode::unsupported, "the image is " + std::to_string(width) + " x " + std::to_string(height) +
                                                " pixels, this OpenGL draws at most " + std::to_string(max_width) +
                                                " x " + std::to_string(max_height));
    return std::clamp(kBandPixels / width, 1, std::min(height, texture_limit));
}

}  // namespace rcs
