#pragma once

#include <cstdint>
#include <string>

#include "process/clock.h"

namespace rcs::service {

/// What a salvage brought.
struct Salvaged {
    std::uint64_t jobs = 0, frames = 0;  ///< that could be read
    std::uint64_t lost = 0;              ///< rows that could not
    std::uint64_t again = 0;             ///< frames whose pictures are not there any more: they wait again
    std::uint64_t numbers = 0;           ///< the next job has a larger one
};

/// Makes a whole database of what can be read of STATE/queue.db, row by row. The old file goes to STATE/aside; pictures
/// stay where they are. Broken off, it can be begun anew.
/// @throws ServiceError
Salvaged salvage_queue(const std::string& state, Moment now);

}  // namespace rcs::service
