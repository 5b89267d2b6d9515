#pragma once

// tinygltf as this library builds it: Draco on, images left to OpenImageIO. Every file that needs
// tinygltf includes this header, so that all see the same definitions.
#define TINYGLTF_ENABLE_DRACO
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#include <tiny_gltf.h>
