#version 450 core
#define RCS_SPLAT_GLOSSY
#include "splat_sums.glsl"
