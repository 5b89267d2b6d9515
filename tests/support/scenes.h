#pragma once

#include "stability/scenes.h"

/// The builders of the stability suite serve the tests as well.
namespace rcs::test {
using namespace rcs::stability;
}
