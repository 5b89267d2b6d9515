#version 450 core
#include "shared/bindings.h"

layout(location = RCS_GBUFFER_ATTRIBUTE_POSITION) in vec3 object_position;
layout(location = RCS_GBUFFER_UNIFORM_CLIP_FROM_OBJECT) uniform mat4 clip_from_object;

void main()
{
    gl_Position = clip_from_object * vec4(object_position, 1.0);
}
