#pragma once

#include <functional>
#include <vector>

#include "rcs/direct_light.h"
#include "rcs/records.h"
#include "rcs/render.h"
#include "render/deadline.h"
#include "render/settings.h"

namespace rcs {

struct Frame;

/// How often light is sampled that is not the records'.
struct Rounds {
    int lobes = 1;   ///< along lobes too narrow for records
    int direct = 1;  ///< of lamps
};

/// How the picture goes on, as quality steers it: what the settings say until the first view's records have told more.
struct Course {
    DirectSettings direct = {};   ///< fewer shadow rays where a budget is too short for them
    RecordSettings records = {};  ///< that holes of further views are filled with
    int passes = 1;               ///< in all
    Rounds rounds = {};           ///< in each pass
    double pass_seconds = 0.0;    ///< what a further pass takes [s]
    double passes_ended = 0.0;    ///< when the last one was done [s since the beginning]
};
Course begin_course(const Settings& settings);

/// Whether one more pass is to follow those that are done. With a budget passes follow what they really take.
/// @param most  passes there may be
bool wants_pass(Course& course, const Deadline& deadline, int done, int most);

/// For the first view, before its direct light: what a budget can afford.
DirectSettings affordable_direct(const Frame& frame);

/// What the first view's records begin as: coarse ones where the error or the time steers what becomes of them.
RecordSettings first_records(const Frame& frame);

/// Places the first view's records by steps to the target or for the time there is, and settles passes and rounds on
/// the way.
/// @param go_on  asked once the forecast is made; false stops after the coarse records
void steer_records(Frame& frame, bool go_on);

/// The same for a view to come, of which nothing but its records is made.
void steer_records_ahead(Frame& frame);

/// Which light is to be sampled once more. @param done  in this pass and layer
/// @return one round more of one of both, as many as the course says, and with a target as many as bring the first view
///         nearer to it; `done`: that is all
Rounds next_round(const Frame& frame, const Rounds& done);

/// Averages a further round into the light of `rounds` rounds.
void add_round(DirectLightResult& light, const DirectLightResult& more, int rounds);

}  // namespace rcs
