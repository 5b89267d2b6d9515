#version 450 core
// Quads: one record at one pixel, blended into the sums.
#define RCS_SPLAT_ONE_RECORD
#include "splat_record.glsl"

flat in int record_index;

layout(location = RCS_SPLAT_TARGET_SUMS) out vec4 sums;    // blend: add
layout(location = RCS_SPLAT_TARGET_COUNT) out float count; // blend: add
#ifdef RCS_SPLAT_ERRORS
layout(location = RCS_SPLAT_TARGET_ERROR) out vec4 error;  // blend: add
#endif
#ifdef RCS_SPLAT_GLOSSY
layout(location = RCS_SPLAT_TARGET_GLOSSY) out vec4 glossy; // blend: add
#endif

void main()
{
    SeenPoint seen = seen_at(ivec2(gl_FragCoord.xy));
    Share share;
    if (!seen.covered || !add_record(record_index, seen, share)) discard;
    sums = share.sums;
    count = 1.0;
#ifdef RCS_SPLAT_ERRORS
    error = share.error;
#endif
#ifdef RCS_SPLAT_GLOSSY
    glossy = share.glossy;
#endif
}
