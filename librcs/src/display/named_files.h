#pragma once

#include <optional>
#include <string>

#include <OpenColorIO/OpenColorIO.h>

namespace rcs {

/// A file that some transform of a configuration would read, used or not; none if it is complete by itself.
std::optional<std::string> named_file(const OCIO_NAMESPACE::ConstConfigRcPtr& config);

}  // namespace rcs
