// Group G: threads, drivers, disks, signals, processor modes.
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "gl/gl_context_impl.h"
#include "gl/gl_objects.h"
#include "rcs/error.h"
#include "rcs/image_io.h"
#include "rcs/option_table.h"
#include "stability/case_run.h"
#include "stability/scenes.h"

namespace rcs::stability {
namespace {

void any_number_of_threads(CaseRun& run)
{
    const Scene scene = furnished_room();
    for (const int bounces : {1, 4}) {
        RenderOptions options = small_options(48);
        options.aa = 2;
        options.bounces = bounces;
        ThreadPool one(1);
        const RenderResult expected = run.render(scene, scene.cameras[0], options, "1 thread", one);
        for (const int threads : {2, 3, 8}) {
            ThreadPool pool(threads);
            const std::string words = std::to_string(threads) + " threads";
            const RenderResult got = run.render(scene, scene.cameras[0], options, words, pool);
            std::string layer;
            run.figure(same_bits(got.image, expected.image, layer) ? 0.0 : 1.0,
                       "pictures with other bits, " + words + (layer.empty() ? "" : ", in layer " + layer));
        }
    }
}

/// What a process of rcsplat is to live with.
struct Circumstances {
    std::vector<std::pair<std::string, std::string>> environment;  ///< set in addition
    long largest_file = -1;                                        ///< [bytes]; -1: no limit
    double kill_after = -1.0;                                      ///< [s]; -1: not killed
};

struct Ended {
    int code = -1;  ///< exit code, or 128 + signal
    std::string said;
};

std::string contents(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

Ended run_program(CaseRun& run, const std::vector<std::string>& arguments, const Circumstances& with = {})
{
    const std::string log = run.folder() + "/log";
    std::vector<std::string> words = {run.program()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    const OptionInfo& gather = find_option("gather");
    words.insert(words.end(),
                 {std::string(gather.name), std::string(gather.choices[static_cast<std::size_t>(run.gather())])});
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    std::vector<std::string> variables;
    for (char** entry = environ; *entry; ++entry) variables.emplace_back(*entry);
    for (const auto& [name, value] : with.environment) variables.push_back(name + "=" + value);
    std::vector<char*> envp;
    for (std::string& variable : variables) envp.push_back(variable.data());
    envp.push_back(nullptr);
    const pid_t pid = ::fork();
    if (pid < 0) throw Error(ErrorCode::io, "cannot start a process");
    if (pid == 0) {
        // Other threads' locks are in any state here: system calls alone until exec.
        const int out = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
        ::dup2(out, 1);
        ::dup2(out, 2);
        if (with.largest_file >= 0) {
            const auto most = static_cast<rlim_t>(with.largest_file);
            const rlimit limit{most, most};
            ::setrlimit(RLIMIT_FSIZE, &limit);
            ::signal(SIGXFSZ, SIG_IGN);  // writing fails instead, as on a full disk
        }
        ::execve(argv[0], argv.data(), envp.data());
        ::_exit(127);
    }
    if (with.kill_after >= 0.0) {
        std::this_thread::sleep_for(std::chrono::duration<double>(with.kill_after));
        ::kill(pid, SIGKILL);
    }
    int status = 0;
    while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
    }
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), contents(log)};
}

bool has_program(CaseRun& run)
{
    if (run.program().empty()) run.skip("needs the program rcsplat");
    return !run.program().empty();
}

std::vector<std::string> small_render(const std::string& output)
{
    return {"render", "demo:cornell", "--size", "64x64", "--aa", "1", "--rays", "16", "-q", "-o", output};
}

// Exit codes of rcsplat, by sysexits.h.
constexpr int kUnavailable = 69, kCannotWrite = 73;

void require_one_error(CaseRun& run, const Ended& ended, int code, const std::string& names, const std::string& words)
{
    run.require(ended.code == code, words + ": exit code " + std::to_string(ended.code) + ": " + ended.said);
    const std::string start = "rcsplat: error: ";
    run.require(ended.said.rfind(start, 0) == 0 && ended.said.find('\n') == ended.said.size() - 1,
                words + ": not one error line: " + ended.said);
    run.require(ended.said.find(names) != std::string::npos,
                words + ": the error does not name " + names + ": " + ended.said);
}

void gl_that_fails(CaseRun& run)
{
    // More memory than there is: an error, and the context still works.
    try {
        const GlTexture first = make_texture(GL_RGBA32F, 16384, 16384);
        check_gl("making a large texture");
        run.note("the GL gives a texture of 4 GiB");
    } catch (const Error& e) {
        run.require(e.code() == ErrorCode::out_of_memory, std::string("no out of memory, but: ") + e.what());
    }
    run.render(furnished_room(), small_options(24), "after running out of memory");
    RenderOptions options = small_options(24);
    options.width = 32768;
    try {
        run.render(furnished_room(), options, "32768 wide");
        run.require(false, "a width of 32768 is taken");
    } catch (const Error& e) {
        run.require(std::string(e.what()).find("32768") != std::string::npos, e.what());
    }
    run.figure(0.0, "errors, and pictures after them");
    if (run.program().empty()) {
        run.note("missing and old GL not tried: needs the program rcsplat");
        return;
    }
    const std::string output = run.folder() + "/no.png";
    require_one_error(
        run, run_program(run, small_render(output), {{{"__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json"}}}),
        kUnavailable, "OpenGL", "no driver");
    if (run.gl().version().find("Mesa") != std::string::npos)
        require_one_error(run,
                          run_program(run, small_render(output),
                                      {{{"MESA_GL_VERSION_OVERRIDE", "3.3"}, {"MESA_GLSL_VERSION_OVERRIDE", "330"}}}),
                          kUnavailable, "4.5", "OpenGL 3.3");
    run.require(!std::filesystem::exists(output), "a picture without OpenGL");
}

void outputs_that_fail(CaseRun& run)
{
    if (!has_program(run)) return;
    const std::string folder = run.folder() + "/out";
    std::filesystem::create_directories(folder + "/taken.png");
    std::filesystem::create_directories(folder + "/closed");
    std::filesystem::permissions(folder + "/closed",
                                 std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
    require_one_error(run, run_program(run, small_render(folder + "/taken.png")), kCannotWrite, "taken.png",
                      "the output is a folder");
    require_one_error(run, run_program(run, small_render(folder + "/missing/a.png")), kCannotWrite, "missing",
                      "the folder is missing");
    if (::geteuid() != 0)  // root may write anywhere
        require_one_error(run, run_program(run, small_render(folder + "/closed/a.png")), kCannotWrite, "closed",
                          "the folder is read-only");
    std::string large = folder + "/full.exr";
    Circumstances full;
    full.largest_file = 4096;
    require_one_error(run, run_program(run, small_render(large), full), kCannotWrite, "full.exr", "the disk is full");
    const std::string older = run.folder() + "/older.exr";
    run_program(run, small_render(older));
    const std::string before = contents(older);
    run.require(!before.empty(), "no picture on a disk with room");
    require_one_error(run, run_program(run, small_render(older), full), kCannotWrite, "older.exr",
                      "the disk is full and there is a picture");
    run.require(contents(older) == before, "the disk is full, and the picture of before is gone or another one");
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) files += entry.is_regular_file();
    run.figure(static_cast<double>(files), "files left behind");
    std::filesystem::permissions(folder + "/closed", std::filesystem::perms::owner_all);
}

void killed_at_any_moment(CaseRun& run)
{
    if (!has_program(run)) return;
    const std::string output = run.folder() + "/killed.exr";
    const auto arguments = small_render(output);
    const auto begin = std::chrono::steady_clock::now();
    run_program(run, arguments);
    const double whole = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    run.require(std::filesystem::exists(output), "no picture when not killed");
    const int tries = 16;
    int there = 0, truncated = 0;
    for (int i = 0; i < tries; ++i) {
        std::filesystem::remove(output);
        Circumstances killed;
        // Mostly near the end, when the file is written.
        killed.kill_after = whole * (0.1 + 0.95 * std::sqrt((i + 0.5) / tries));
        run_program(run, arguments, killed);
        if (!std::filesystem::exists(output)) continue;
        ++there;
        try {
            const Image beauty = read_image(output).layers.at("beauty");
            truncated += beauty.width != 64 || beauty.height != 64;
        } catch (const Error&) {
            ++truncated;
        }
    }
    run.figure(static_cast<double>(truncated), "truncated pictures");
    run.note(std::to_string(there) + " of " + std::to_string(tries) + " killed runs had a picture");
}

void denormals(CaseRun& run)
{
#if defined(__SSE2__)
    const Scene scene = furnished_room();
    const RenderOptions options = small_options(64);
    const RenderResult plain = run.render(scene, options, "denormals kept");
    // Threads inherit the mode from the one that makes them.
    struct Mode {
        unsigned before = _mm_getcsr();
        ~Mode() { _mm_setcsr(before); }
    } const mode;
    _mm_setcsr(mode.before | 0x8040u);  // flush to zero, denormals are zero
    ThreadPool flushing(run.pool().size());
    const RenderResult flushed = run.render(scene, scene.cameras[0], options, "denormals flushed", flushing);
    run.figure(worst_difference(flushed.image, plain.image, "beauty"), "worst pixel");
    // Radiance itself near the least float.
    Scene dim = scene;
    for (Material& material : dim.materials) material.emission *= 0x1p-120f;
    for (PunctualLight& light : dim.lights) light.intensity *= 0x1p-120f;
    run.render(dim, dim.cameras[0], options, "radiance of 2^-120", flushing);
#else
    run.skip("this processor has no such modes");
#endif
}

}  // namespace

std::vector<SuiteCase> machine_cases()
{
    const std::string group = "machine";
    return {
        {{"G1", group, "1, 2, 3 and 8 threads, 1 and 4 bounces", "results that depend on timing", "same bits", 0.0,
          "nothing may depend on threads", true},
         any_number_of_threads},
        {{"G2", group, "No OpenGL driver, OpenGL 3.3, out of its memory, too large a picture",
          "crash, a library that is of no use afterwards", "one clear error each, then pictures again", 0.0,
          "nothing is measured", true},
         gl_that_fails},
        {{"G3", group, "Output that is a folder, in a missing or closed folder, on a full disk",
          "half a file under the final name", "one clear error each, no file; a picture of before stays", 0.0,
          "nothing may be left", true},
         outputs_that_fail},
        {{"G4", group, "rcsplat killed at 16 moments", "a truncated picture under its final name",
          "no file, or a whole one", 0.0, "none may be truncated", false},
         killed_at_any_moment},
        {{"G5", group, "Denormals kept and flushed to zero; radiance of 2^-120", "results that hang on denormals",
          "same picture", 1e-5, "what lies below 1e-38 is no light", true},
         denormals},
    };
}

}  // namespace rcs::stability
