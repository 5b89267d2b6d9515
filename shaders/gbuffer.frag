#version 450 core
#include "shared/bindings.h"

layout(location = RCS_GBUFFER_UNIFORM_INSTANCE) uniform uint instance;
layout(location = RCS_GBUFFER_TARGET_IDS) out uvec2 ids;

void main()
{
    ids = uvec2(instance, uint(gl_PrimitiveID));
}
