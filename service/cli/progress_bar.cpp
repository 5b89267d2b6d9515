#include "cli/progress_bar.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <unistd.h>

#include "process/interrupt.h"
#include "process/printable.h"

namespace rcs::service {
namespace {

constexpr int kBarWidth = 32;  ///< [characters]
constexpr auto kRedraw = std::chrono::milliseconds(80);
constexpr auto kShortStage = std::chrono::seconds(1);
constexpr auto kBetweenLines = std::chrono::seconds(10);

bool stderr_is_terminal()
{
    const char* term = std::getenv("TERM");
    return ::isatty(STDERR_FILENO) != 0 && (term == nullptr || std::strcmp(term, "dumb") != 0);
}

double seconds(std::chrono::steady_clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

const char* level_name(LogLevel level)
{
    switch (level) {
        case LogLevel::debug:
            return "debug";
        case LogLevel::info:
            return "info";
        case LogLevel::warning:
            return "warning";
    }
    return "";
}

}  // namespace

ProgressBar::ProgressBar(LogLevel least, bool quiet)
    : least_(least), quiet_(quiet), terminal_(stderr_is_terminal()), last_output_(Clock::now())
{
}

ProgressBar::~ProgressBar() { clear_line(); }

void ProgressBar::begin(std::string_view stage)
{
    end_stage();
    stage_ = stage;
    stage_begin_ = Clock::now();
}

void ProgressBar::end_stage()
{
    const Clock::time_point now = Clock::now();
    if (!stage_.empty() && !quiet_ && !terminal_ && now - stage_begin_ >= kShortStage) {
        std::fprintf(stderr, "rcsplat: %s %.1f s\n", stage_.c_str(), seconds(now - stage_begin_));
    }
    stage_.clear();
}

void ProgressBar::clear_line()
{
    if (drawn_) {
        std::fputs("\r\033[K", stderr);
        drawn_ = false;
    }
}

void ProgressBar::show(std::string_view stage, float fraction, const std::string& detail)
{
    const bool changed = stage != stage_;
    if (changed) {
        begin(stage);
    }
    const Clock::time_point now = Clock::now();
    const Clock::duration pause = terminal_ ? Clock::duration(kRedraw) : Clock::duration(kBetweenLines);
    if (quiet_ || (now - last_output_ < pause && !(changed && terminal_))) {
        return;
    }
    last_output_ = now;
    const float part = fraction > 0.0f ? std::min(fraction, 1.0f) : 0.0f;
    if (!terminal_) {
        std::fprintf(stderr, "rcsplat: %s %d %%%s%s\n", stage_.c_str(), static_cast<int>(part * 100.0f),
                     detail.empty() ? "" : ", ", detail.c_str());
        return;
    }
    char took[40];
    std::snprintf(took, sizeof took, "%.1f s", seconds(now - stage_begin_));
    draw_bar(part, detail.empty() ? took : detail);
}

void ProgressBar::draw_bar(float part, const std::string& detail)
{
    const int filled = static_cast<int>(part * kBarWidth);
    const std::string bar = std::string(static_cast<std::size_t>(filled), '#') +
                            std::string(static_cast<std::size_t>(kBarWidth - filled), '.');
    std::fprintf(stderr, "\r\033[K%-10s [%s] %3d %%  %s", stage_.c_str(), bar.c_str(), static_cast<int>(part * 100.0f),
                 detail.c_str());
    std::fflush(stderr);
    drawn_ = true;
}

void ProgressBar::finish()
{
    end_stage();
    clear_line();
}

ProgressFunction ProgressBar::progress()
{
    return [this](std::string_view stage, float fraction) {
        show(stage, fraction);
        return interrupt_signal() == 0;
    };
}

LogFunction ProgressBar::log()
{
    return [this](LogLevel level, std::string_view line) {
        if (level < least_) {
            return;
        }
        clear_line();
        std::fprintf(stderr, "rcsplat: %s: %s\n", level_name(level), printable(line).c_str());
    };
}

}  // namespace rcs::service
