// The codes that commands end with, of docs/batches.md.

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "process/exit_code.h"
#include "support/rcsplat.h"
#include "support/small_render.h"
#include "support/temporary_folder.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

using test::rcsplat;
using test::small_render;

TEST(ExitCode, SaysWhatKindOfThingWentWrong)
{
    const test::TemporaryFolder folder;
    test::write_bytes(folder / "bad.glb", "glTF, but no more");
    const std::string picture = folder / "a.png";
    EXPECT_EQ(rcsplat(small_render("demo:furnace", {"-o", picture})).code, 0);
    EXPECT_EQ(rcsplat(small_render("demo:furnace", {"-o", picture, "--aa", "0"})).code, kBadUsage);
    EXPECT_EQ(rcsplat(small_render(folder / "bad.glb", {"-o", picture})).code, kBadData);
    EXPECT_EQ(rcsplat(small_render(folder / "none.glb", {"-o", picture})).code, kNoInput);
    EXPECT_EQ(rcsplat(small_render("demo:furnace", {"-o", picture, "--camera", "none"})).code, kNoInput);
    EXPECT_EQ(rcsplat(small_render("demo:furnace", {"-o", "/dev/full/a.png"})).code, kCannotWrite);
    EXPECT_EQ(rcsplat(small_render("demo:furnace", {"-o", folder / "none/a.png"})).code, kCannotWrite);
}

TEST(ExitCode, TellsAColourConfigurationFromOtherFiles)
{
    const test::TemporaryFolder folder;
    test::write_bytes(folder / "bad.ocio", "ocio_profile_version: many");
    const std::string picture = folder / "a.png";
    EXPECT_EQ(rcsplat(small_render("demo:furnace", {"-o", picture, "--ocio", folder / "bad.ocio"})).code, kBadConfig);
    EXPECT_EQ(rcsplat({"reference", "demo:furnace", "--size", "8x8", "--spp", "16", "-o", picture, "--ocio",
                       folder / "bad.ocio"})
                  .code,
              kBadConfig);
    EXPECT_EQ(rcsplat(small_render("demo:furnace", {"-o", picture, "--ocio", folder / "none.ocio"})).code, kNoInput);
}

TEST(ExitCode, KnowsWhatAServerRefuses)
{
    const test::TemporaryFolder folder;
    EXPECT_EQ(rcsplat({"list", "--server", folder / "nobody"}).code, kTryAgain);
    EXPECT_EQ(exit_code(v1::ERROR_CODE_VERSION), kProtocol);
    EXPECT_EQ(exit_code(v1::ERROR_CODE_UNAUTHENTICATED), kNotPermitted);
    EXPECT_EQ(exit_code(v1::ERROR_CODE_LIMIT), kNotPermitted);
    EXPECT_EQ(exit_code(v1::ERROR_CODE_TIME_LIMIT), kFailed);
    EXPECT_EQ(exit_code(v1::ERROR_CODE_MEMORY_LIMIT), kTryAgain);
    EXPECT_EQ(exit_code(v1::ERROR_CODE_IO), kCannotWrite);
}

TEST(ExitCode, KnowsEveryError)
{
    EXPECT_EQ(exit_code(ErrorCode::gl_unavailable), kUnavailable);
    EXPECT_EQ(exit_code(ErrorCode::out_of_memory), kTryAgain);
    EXPECT_EQ(exit_code(ErrorCode::unsupported), kBadData);
    EXPECT_EQ(exit_code(ErrorCode::internal), kInternal);
    EXPECT_EQ(exit_code(ErrorCode::cancelled), kFailed) << "where no signal came";
}

}  // namespace
}  // namespace rcs::service
