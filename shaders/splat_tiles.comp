#version 450 core
// Tiles: a work group is a tile of the image, an invocation one of its pixels, which adds the tile's records to its
// sums one after the other, in their order.
#include "splat_record.glsl"

layout(local_size_x = RCS_SPLAT_TILE, local_size_y = RCS_SPLAT_TILE) in;

layout(std430, binding = RCS_SPLAT_BUFFER_TILES) readonly buffer Tiles
{
    uint first[];  // of each tile's records, and one more
};
layout(std430, binding = RCS_SPLAT_BUFFER_IN_TILES) readonly buffer InTiles
{
    uint in_tiles[];  // records, tile after tile
};
layout(location = RCS_SPLAT_UNIFORM_BAND) uniform ivec3 band;

layout(binding = RCS_SPLAT_TARGET_SUMS, rgba32f) uniform image2D sums;
layout(binding = RCS_SPLAT_TARGET_COUNT, r32f) uniform image2D counts;
#ifdef RCS_SPLAT_ERRORS
layout(binding = RCS_SPLAT_TARGET_ERROR, rgba32f) uniform image2D errors;
#endif
#ifdef RCS_SPLAT_GLOSSY
layout(binding = RCS_SPLAT_TARGET_GLOSSY, rgba32f) uniform image2D glossies;
#endif

void main()
{
    // A band may begin and end within tiles.
    ivec2 tile = ivec2(gl_WorkGroupID.x, band.x / RCS_SPLAT_TILE + int(gl_WorkGroupID.y));
    ivec2 pixel = RCS_SPLAT_TILE * tile + ivec2(gl_LocalInvocationID.xy) - ivec2(0, band.x);
    if (pixel.x >= image_size.x || pixel.y < 0 || pixel.y >= band.y) return;
    bool begins = band.z != 0;
    SeenPoint seen = seen_at(pixel);
    int tile_number = tile.y * int(gl_NumWorkGroups.x) + tile.x;
    vec4 sum = begins ? vec4(0.0) : imageLoad(sums, pixel);
    float count = begins ? 0.0 : imageLoad(counts, pixel).r;
#ifdef RCS_SPLAT_ERRORS
    vec4 error = begins ? vec4(0.0) : imageLoad(errors, pixel);
#endif
#ifdef RCS_SPLAT_GLOSSY
    vec4 glossy = begins ? vec4(0.0) : imageLoad(glossies, pixel);
#endif
    uint end = seen.covered ? first[tile_number + 1] : first[tile_number];
    for (uint k = first[tile_number]; k < end; ++k) {
        Share share;
        if (!add_record(int(in_tiles[k]), seen, share)) continue;
        sum += share.sums;
        count += 1.0;
#ifdef RCS_SPLAT_ERRORS
        error += share.error;
#endif
#ifdef RCS_SPLAT_GLOSSY
        glossy += share.glossy;
#endif
    }
    imageStore(sums, pixel, sum);
    imageStore(counts, pixel, vec4(count));
#ifdef RCS_SPLAT_ERRORS
    imageStore(errors, pixel, error);
#endif
#ifdef RCS_SPLAT_GLOSSY
    imageStore(glossies, pixel, glossy);
#endif
}
