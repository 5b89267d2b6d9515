#include "corpus/corpus.h"

#include <cmath>
#include <random>
#include <set>

#include "rcs/gl_context.h"
#include "rcs/ray_scene.h"
#include "rcs/render.h"
#include "rcs/thread_pool.h"
#include "support/session.h"

// Every file renders, or names what it lacks, or is one clear error.

namespace rcs::test {
namespace {

/// Writes the files and loads the scene among them.
Scene load(const CorpusFile& file, Log& log)
{
    const TemporaryFolder folder;
    write_files(file, folder / "inside");
    return load_scene(folder / ("inside/" + file.files.front().first), log.function(), {file.time});
}

RenderOptions small_options()
{
    RenderOptions options;
    options.width = options.height = 32;
    options.aa = 1;
    settings_of(options).rays = 16;
    settings_of(options).error_tolerance = 1.0f;
    options.area_samples = options.penumbra_samples = 1;
    return options;
}

/// Finite everywhere, and something is seen.
void expect_picture(const LayeredImage& image)
{
    const Image& beauty = image.layers.at("beauty");
    ASSERT_EQ(beauty.channels, 4);
    double cover = 0.0;
    bool finite = true;
    for (std::size_t i = 0; i < beauty.pixels.size(); ++i) {
        finite = finite && std::isfinite(beauty.pixels[i]) && beauty.pixels[i] >= 0.0f;
        if (i % 4 == 3) cover += beauty.pixels[i];
    }
    EXPECT_TRUE(finite);
    EXPECT_GT(cover, 0.0);
}

TEST(Corpus, EveryInvalidFileIsOneClearError)
{
    for (const CorpusFile& file : whole_corpus()) {
        if (!file.error) continue;
        SCOPED_TRACE(file.name);
        Log log;
        expect_error(*file.error, {"inside/", file.word}, [&] { load(file, log); });
    }
}

TEST(Corpus, EveryValidFileRendersAndSaysWhatIsLeftOut)
{
    ThreadPool pool(2);
    Session session(test::shared_gl(), pool);
    for (const CorpusFile& file : whole_corpus()) {
        if (file.error) continue;
        SCOPED_TRACE(file.name);
        try {
            Log log;
            const Scene scene = load(file, log);
            std::string said;
            for (const std::string& line : log.lines) said += line + "\n";
            if (file.word.empty())
                EXPECT_EQ(said, "");
            else
                EXPECT_EQ(log.count(file.word), 1) << file.word << " in:\n" << said;
            session.show(scene);
            expect_picture(render(session, find_camera(scene, ""), small_options()).image);
        } catch (const Error& e) {
            ADD_FAILURE() << e.what();
        }
    }
}

TEST(Corpus, DamagedAtRandomFilesLoadOrThrow)
{
    std::mt19937 random(7);
    for (CorpusFile file : whole_corpus()) {
        if (file.error) continue;
        SCOPED_TRACE(file.name);
        const std::string whole = file.files.front().second;
        for (int round = 0; round < 4; ++round) {
            std::string& bytes = file.files.front().second;
            bytes = whole;
            for (unsigned i = 0; i < 1 + random() % 3; ++i)
                bytes[random() % bytes.size()] = static_cast<char>(random());
            Log log;
            try {
                validate(load(file, log));
            } catch (const Error&) {
            }
        }
    }
}

TEST(Corpus, HasAtLeast150FilesOfDifferentNames)
{
    std::set<std::string> names;
    int errors = 0;
    for (const CorpusFile& file : whole_corpus()) {
        names.insert(file.name);
        errors += file.error.has_value();
    }
    EXPECT_EQ(names.size(), whole_corpus().size());
    EXPECT_GE(names.size(), 150u);
    EXPECT_GE(errors, 75);
    RecordProperty("files", static_cast<int>(names.size()));
}

}  // namespace
}  // namespace rcs::test
