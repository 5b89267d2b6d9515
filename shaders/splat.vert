#version 450 core
#include "shared/bindings.h"
#include "shared/gpu_record.h"

layout(std430, binding = RCS_SPLAT_BUFFER_RECORDS) readonly buffer Records
{
    GpuRecord records[];
};
layout(location = RCS_SPLAT_UNIFORM_IMAGE_SIZE) uniform ivec2 image_size;

flat out int record_index;

// A strip of four corners: the pixel rectangle of the record. Row 0 of the image is row 0 of the target.
void main()
{
    ivec4 pixels = records[gl_InstanceID].pixels;
    ivec2 corner = ivec2((gl_VertexID & 1) == 0 ? pixels.x : pixels.z,
                         (gl_VertexID & 2) == 0 ? pixels.y : pixels.w);
    record_index = gl_InstanceID;
    gl_Position = vec4(2.0 * vec2(corner) / vec2(image_size) - 1.0, 0.0, 1.0);
}
