#pragma once

#include <initializer_list>
#include <string>
#include <utility>

#include <epoxy/gl.h>

namespace rcs {

/// Owns one OpenGL name; the context it belongs to must be current when it is destroyed.
template <void (*destroy)(GLuint)>
class GlObject {
public:
    GlObject() = default;
    explicit GlObject(GLuint id) : id_(id) {}
    ~GlObject() { reset(); }
    GlObject(GlObject&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
    GlObject& operator=(GlObject&& other) noexcept
    {
        if (this != &other) {
            reset();
            id_ = std::exchange(other.id_, 0);
        }
        return *this;
    }
    GLuint id() const noexcept { return id_; }
    /// Gives up ownership, for names that die with their context.
    GLuint release() noexcept { return std::exchange(id_, 0); }

private:
    void reset() noexcept
    {
        if (id_ != 0) destroy(release());
    }
    GLuint id_ = 0;
};

inline void delete_texture(GLuint id) { glDeleteTextures(1, &id); }
inline void delete_buffer(GLuint id) { glDeleteBuffers(1, &id); }
inline void delete_framebuffer(GLuint id) { glDeleteFramebuffers(1, &id); }
inline void delete_vertex_array(GLuint id) { glDeleteVertexArrays(1, &id); }
inline void delete_shader(GLuint id) { glDeleteShader(id); }
inline void delete_program(GLuint id) { glDeleteProgram(id); }

using GlTexture = GlObject<delete_texture>;
using GlBuffer = GlObject<delete_buffer>;
using GlFramebuffer = GlObject<delete_framebuffer>;
using GlVertexArray = GlObject<delete_vertex_array>;
using GlShader = GlObject<delete_shader>;
using GlProgram = GlObject<delete_program>;

/// @throws Error gl_unavailable, or out_of_memory for GL_OUT_OF_MEMORY, if the GL has met an error
/// since it was last asked. @param stage  what was being done, for the message
void check_gl(const std::string& stage);

/// One level, nearest filter, contents undefined.
GlTexture make_texture(GLenum internal_format, int width, int height);

/// Storage of `bytes`, filled later with glNamedBufferSubData.
GlBuffer make_buffer(GLsizeiptr bytes);

/// Draws to the given textures as colour attachments 0, 1, ..., of which some may be 0, as may `depth`.
/// @throws Error gl_unavailable if the driver cannot draw to this combination
GlFramebuffer make_framebuffer(const std::string& stage, std::initializer_list<GLuint> colors, GLuint depth);

GlVertexArray make_vertex_array();

/// How many rows of an image to draw at once, so that large images need no more GL memory than small ones.
/// @throws Error unsupported: the GL's limit on the size of an image
int band_rows(int width, int height);

}  // namespace rcs
