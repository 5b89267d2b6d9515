// Where buffers, textures, uniforms and attributes are bound: read by C++ and GLSL.
#ifdef __cplusplus
#pragma once
#endif

// Pass gbuffer: which triangle does each pixel see?
#define RCS_GBUFFER_ATTRIBUTE_POSITION 0        // vec3, object space
#define RCS_GBUFFER_UNIFORM_CLIP_FROM_OBJECT 0  // mat4
#define RCS_GBUFFER_UNIFORM_INSTANCE 1          // uint, index into Scene::instances
#define RCS_GBUFFER_TARGET_IDS 0                // RG32UI: instance, primitive

// Pass splat: the sums over all records at each pixel.
#define RCS_SPLAT_BUFFER_RECORDS 0      // std430, GpuRecord[]
#define RCS_SPLAT_TEXTURE_POSITION 0    // RGBA32F: relative to the camera; a = 1 where covered
#define RCS_SPLAT_TEXTURE_NORMAL 1      // RGBA32F: shading normal; a unused
#define RCS_SPLAT_UNIFORM_IMAGE_SIZE 0  // ivec2 [px]
#define RCS_SPLAT_TARGET_SUMS 0         // RGBA32F: rgb sum w E, a sum w
#define RCS_SPLAT_TARGET_COUNT 1        // R32F: records with w > 0
#define RCS_SPLAT_TARGET_ERROR 2        // RGBA32F: r sum w L^2, g sum w v, b sum w^2 v; a unused
// ... and with glossy light
#define RCS_SPLAT_BUFFER_RADIANCE 1  // std430, GpuRadiance[]
#define RCS_SPLAT_BUFFER_LOBES 2     // std430, vec4[9] per pixel of the band
#define RCS_SPLAT_TARGET_GLOSSY 3    // RGBA32F: rgb sum w L; a unused
// ... whose lobes pass lobes makes from these, and from positions and normals
#define RCS_LOBES_BUFFER_FITS 3     // std430, GpuLobeFits
#define RCS_LOBES_TEXTURE_LOBE 2    // RGBA32F: roughness over its range, f0, f90 - f0; a = 1 where there is a lobe
#define RCS_LOBES_UNIFORM_TOWARD 1  // vec4: where the viewer is, if a != 0; else where position is 0
#define RCS_LOBES_GROUP 8           // [px]; a side of a work group
// ... and by tiles in compute, where the targets are images of the same numbers
#define RCS_SPLAT_BUFFER_TILES 3     // std430, uint[]: where each tile's records begin in the next, and one more
#define RCS_SPLAT_BUFFER_IN_TILES 4  // std430, uint[]: records, tile after tile
#define RCS_SPLAT_UNIFORM_BAND 1     // ivec3: first row of the band, how many [px]; whether sums begin at 0
#define RCS_SPLAT_TILE 16            // [px]; a tile is a work group

// Pass rays: which surface does each ray meet?
#define RCS_RAYS_BUFFER_NODES 0      // std430, uvec4[]: device_scene.h
#define RCS_RAYS_BUFFER_TRIANGLES 1  // std430, uvec4[]
#define RCS_RAYS_BUFFER_INSTANCES 2  // std430, uvec4[]
#define RCS_RAYS_BUFFER_RAYS 3       // std430, vec4[2] a ray: origin, end; direction, 0
#define RCS_RAYS_BUFFER_RESULTS \
    4                             // std430, uvec4[2] a ray: t, u, v, instance; normal, primitive
                                  // ... shadow rays: uint[], what became of it
#define RCS_RAYS_UNIFORM_COUNT 0  // uint, rays
#define RCS_RAYS_UNIFORM_ROOTS 1  // uvec2: of what is in scene space, of instances
#define RCS_RAYS_GROUP 64         // rays a work group
