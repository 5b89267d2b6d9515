#include "rcs/gl_context.h"

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "gl/gl_context_impl.h"
#include "gl/gl_libraries.h"
#include "gl/shader_sources.h"
#include "rcs/error.h"

namespace {

using namespace rcs;

std::string message_of(const std::function<void()>& body, ErrorCode expected)
{
    try {
        body();
    } catch (const Error& e) {
        EXPECT_EQ(static_cast<int>(e.code()), static_cast<int>(expected)) << e.what();
        return e.what();
    }
    ADD_FAILURE() << "nothing was thrown";
    return "";
}

TEST(GlContext, SaysWhatItIs)
{
    const GlContext gl;
    EXPECT_TRUE(gl.platform() == "device" || gl.platform() == "surfaceless") << gl.platform();
    EXPECT_FALSE(gl.renderer().empty());
    EXPECT_GE(gl.version().substr(0, 3), "4.5");
    EXPECT_TRUE(gl.software() || gl.renderer().find("llvmpipe") == std::string::npos);
}

TEST(GlContext, LogsItsChoice)
{
    std::string logged;
    const GlContext gl([&](LogLevel, std::string_view line) { logged += std::string(line) + "\n"; });
    EXPECT_NE(logged.find(gl.renderer()), std::string::npos) << logged;
}

TEST(GlContext, SurvivesTheEndOfAnotherOnTheSameDisplay)
{
    GlContext kept;
    {
        GlContext other;
        EXPECT_NE(other.impl().program("gbuffer.vert", "gbuffer.frag"), 0u);
    }
    kept.impl().make_current();
    EXPECT_NE(kept.impl().program("gbuffer.vert", "gbuffer.frag"), 0u);
    const GlTexture texture = make_texture(GL_RGBA32F, 4, 4);
    EXPECT_NO_THROW(check_gl("test"));
}

TEST(GlContext, CanBeMadeAndReleasedManyTimes)
{
    for (int i = 0; i < 20; ++i) {
        GlContext gl;
        EXPECT_NE(gl.impl().program("splat.vert", "splat.frag"), 0u);
    }
    EXPECT_EQ(eglGetCurrentContext(), EGL_NO_CONTEXT);
}

TEST(GlContext, BuildsEachProgramOnce)
{
    GlContext gl;
    const GLuint program = gl.impl().program("splat.vert", "splat.frag");
    EXPECT_EQ(gl.impl().program("splat.vert", "splat.frag"), program);
}

// EGL finds no driver at all when its vendor list is empty. A process of its own: EGL reads the list once.
TEST(GlContextDeathTest, ListsEveryAttemptWhenNoneWorks)
{
    ::testing::FLAGS_gtest_death_test_style = "threadsafe";
    EXPECT_EXIT(
        {
            setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json", 1);
            try {
                const GlContext gl;
            } catch (const Error& e) {
                std::fprintf(stderr, "%s\n", e.what());
                std::exit(e.code() == ErrorCode::gl_unavailable ? 3 : 4);
            }
            std::exit(0);
        },
        ::testing::ExitedWithCode(3), "no OpenGL 4.5 through EGL; tried .*EGL devices: .*surfaceless");
}

TEST(GlLibraries, ThatAreMissingAreNamedWithTheirPackage)
{
    EXPECT_NO_THROW(expect_library({"libno-such-gl.so.7", "libEGL.so.1"}, "libegl1"));
    EXPECT_EQ(
        message_of([] { expect_library({"libno-such-gl.so.7", "libnone.so"}, "libgl7"); }, ErrorCode::gl_unavailable),
        "there is no libno-such-gl.so.7 or libnone.so: install OpenGL (Debian: libgl7)");
}

TEST(CheckGl, NamesStageAndError)
{
    const GlContext gl;
    glEnable(GL_TEXTURE_2D_ARRAY);  // no such capability
    const std::string message = message_of([] { check_gl("stage seven"); }, ErrorCode::gl_unavailable);
    EXPECT_EQ(message, "stage seven: OpenGL reported GL_INVALID_ENUM");
    EXPECT_NO_THROW(check_gl("the error is not reported twice"));
}

TEST(CheckGl, ReportsAnImageTooLargeForTheGlAsOutOfMemory)
{
    const GlContext gl;
    if (!gl.software()) GTEST_SKIP() << "4 GiB may well fit a hardware GL";
    message_of(
        [] {
            const GlTexture texture = make_texture(GL_RGBA32F, 16384, 16384);
            check_gl("test");
        },
        ErrorCode::out_of_memory);
}

TEST(BandRows, KeepsSmallImagesWholeAndRefusesWhatTheGlCannotDraw)
{
    const GlContext gl;
    EXPECT_EQ(band_rows(1, 1), 1);
    EXPECT_EQ(band_rows(1000, 1000), 1000);
    EXPECT_LT(band_rows(8192, 8192), 8192);
    const std::string message = message_of([] { band_rows(1 << 20, 1); }, ErrorCode::unsupported);
    EXPECT_NE(message.find("1048576 x 1"), std::string::npos) << message;
}

TEST(ResolveIncludes, ReplacesEachFileOnceAndNumbersTheLines)
{
    const ShaderFiles files = {{"a", "#version 450 core\n#include \"b\"\nafter b\n#include \"c\"\nend\n"},
                               {"b", "in b\n#include \"c\"\n"},
                               {"c", "in c\n"}};
    const ResolvedShader shader = resolve_includes(files, "a");
    EXPECT_EQ(shader.files, (std::vector<std::string>{"a", "b", "c"}));
    EXPECT_EQ(shader.text,
              "#version 450 core\n"
              "#line 1 1\nin b\n#line 1 2\nin c\n#line 3 1\n"
              "#line 3 0\nafter b\n#line 5 0\nend\n");
}

TEST(ResolveIncludes, NamesAMissingFile)
{
    const ShaderFiles files = {{"a", "#include \"shared/nowhere.h\"\n"}};
    const std::string message = message_of([&] { resolve_includes(files, "a"); }, ErrorCode::internal);
    EXPECT_NE(message.find("shared/nowhere.h"), std::string::npos) << message;
}

TEST(BuildProgram, ReportsTheDriversLogWithFileAndLine)
{
    const GlContext gl;
    ShaderFiles files = shader_sources();
    files["broken.h"] = "\nfloat broken() { return undefined_name; }\n";
    files["broken.frag"] = "#version 450 core\n#include \"broken.h\"\nvoid main() { broken(); }\n";
    const std::string message =
        message_of([&] { build_program(files, "gbuffer.vert", "broken.frag"); }, ErrorCode::internal);
    EXPECT_NE(message.find("undefined_name"), std::string::npos) << message;
    EXPECT_NE(message.find("1 = broken.h"), std::string::npos) << message;
    if (gl.version().find("Mesa") != std::string::npos) {
        EXPECT_NE(message.find("1:2("), std::string::npos) << message;  // file 1, line 2
    }
    EXPECT_NO_THROW(check_gl("nothing is left behind"));
}

}  // namespace
