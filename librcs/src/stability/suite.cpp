#include <algorithm>
#include <chrono>
#include <exception>
#include <string>
#include <tuple>

#include "rcs/error.h"
#include "rcs/stability.h"
#include "stability/case_run.h"
#include "stability/metamorphic.h"

namespace rcs {
namespace {

using stability::CaseRun;
using stability::SuiteCase;

/// As people count: B2 before B10, B6 before B6b.
bool comes_before(const SuiteCase& a, const SuiteCase& b)
{
    const auto parts = [](const std::string& id) {
        std::size_t end = 1;
        const int number = std::stoi(id.substr(1), &end);
        return std::make_tuple(id[0], number, id.substr(1 + end));
    };
    return parts(a.says.id) < parts(b.says.id);
}

const std::vector<SuiteCase>& suite()
{
    static const std::vector<SuiteCase> all = [] {
        std::vector<SuiteCase> rows;
        for (const auto& group :
             {stability::light_transport_cases, stability::record_cases, stability::record_scene_cases,
              stability::view_cases, stability::geometry_cases, stability::geometry_file_cases,
              stability::light_and_material_cases, stability::time_cases, stability::machine_cases}) {
            const std::vector<SuiteCase> more = group();
            rows.insert(rows.end(), more.begin(), more.end());
        }
        std::sort(rows.begin(), rows.end(), comes_before);
        return rows;
    }();
    return all;
}

std::vector<StabilityCase> list_of(const std::vector<SuiteCase>& rows)
{
    std::vector<StabilityCase> list;
    for (const SuiteCase& row : rows) list.push_back(row.says);
    return list;
}

StabilityOutcome run_row(const StabilityMachine& machine, const std::vector<SuiteCase>& rows, const std::string& id)
{
    const auto row = std::find_if(rows.begin(), rows.end(), [&](const SuiteCase& r) { return r.says.id == id; });
    if (row == rows.end()) {
        std::string names;
        for (const SuiteCase& r : rows) names += (names.empty() ? "" : ", ") + r.says.id;
        throw Error(ErrorCode::not_found, "there is no case '" + id + "'; there are " + names);
    }
    const auto begin = std::chrono::steady_clock::now();
    CaseRun run(machine, row->says);
    try {
        row->run(run);
    } catch (const std::exception& e) {
        run.require(false, std::string("stopped by an error: ") + e.what());
    }
    StabilityOutcome outcome = run.finish();
    outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return outcome;
}

}  // namespace

const std::vector<StabilityCase>& stability_cases()
{
    static const std::vector<StabilityCase> list = list_of(suite());
    return list;
}

const std::vector<StabilityCase>& metamorphic_cases()
{
    static const std::vector<StabilityCase> list = list_of(stability::metamorphic_rows(nullptr));
    return list;
}

StabilityOutcome run_stability_case(const StabilityMachine& machine, const std::string& id)
{
    return run_row(machine, suite(), id);
}

StabilityOutcome run_metamorphic_case(const StabilityMachine& machine, const std::string& id, const Scene& scene,
                                      const Camera& camera, const RenderOptions& options)
{
    const stability::Subject subject{scene, camera, options};
    return run_row(machine, stability::metamorphic_rows(&subject), id);
}

}  // namespace rcs
