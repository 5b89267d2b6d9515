#version 450 core
#include "splat_sums.glsl"
