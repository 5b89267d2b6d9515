#pragma once

#include <vector>

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include "rays/ray_scene_impl.h"

namespace rcs {

/// What Embree holds; released in the destructor.
struct EmbreeScene {
    RTCDevice device = nullptr;
    RTCScene top = nullptr;
    std::vector<RTCScene> objects;  ///< per mesh; null unless it is instanced

    /// @throws Error internal
    explicit EmbreeScene(int threads);
    ~EmbreeScene();
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;
};

/// Gives Embree the triangles of the instances: baked into scene space where a mesh is used once, else shared.
/// @param impl  its instances described; their positions are set
/// @throws Error out_of_memory, internal: what Embree reported
void build_acceleration(RayScene::Impl& impl);

/// @throws Error out_of_memory, internal: what Embree has reported since it was last asked
void throw_on_error(RTCDevice device, const char* what);

/// Asked by Embree for each meeting of rays with a surface that may let them through.
void filter_hits(const RTCFilterFunctionNArguments* arguments);

}  // namespace rcs
