#include "gl/gl_libraries.h"

#include <string>

#include <dlfcn.h>

#include "rcs/error.h"

namespace rcs {

void expect_library(std::initializer_list<const char*> any_of, const char* package)
{
    std::string names;
    for (const char* name : any_of) {
        if (dlopen(name, RTLD_LAZY | RTLD_LOCAL) != nullptr) return;  // stays open: it is needed from here on
        names += (names.empty() ? "" : " or ") + std::string(name);
    }
    throw Error(ErrorCode::gl_unavailable, "there is no " + names + ": install OpenGL (Debian: " + package + ")");
}

}  // namespace rcs
