// tinygltf is one header; its implementation is compiled here and nowhere else.
#define TINYGLTF_IMPLEMENTATION
#include "scene/tinygltf.h"
