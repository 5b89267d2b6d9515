#pragma once

#include <string>

/// Small encoded images.
namespace rcs::test {

// 2 x 2 RGB, 8 bit: (255,0,0) (0,128,0) / (10,20,30) (200,100,50). Made with zlib, by hand otherwise.
inline const std::string kPicture(
    "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x02\0\0\0\x02\x08\x02\0\0\0\xfd\xd4\x9a\x73\0\0\0\x16IDAT\x78\xda\x63\xf8\xcf"
    "\xc0\xc0\xd0\xc0\xc0\xc0\x25\x22\x77\x22\xc5\x08\0\x15\xeb\x03\x1a\x82\x45\x30\x77\0\0\0\0IEND\xae\x42\x60\x82",
    79);
// 1 x 1 grey, 16 bit: 32768.
inline const std::string kDeepPicture(
    "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01\0\0\0\x01\x10\0\0\0\0\x6a\xee\x47\x16\0\0\0\x0bIDAT\x78\xda\x63\x68\x60"
    "\0\0\x01\x03\0\x81\xad\xe8\xb2\x74\0\0\0\0IEND\xae\x42\x60\x82",
    68);
// 2 x 1 RGBA: (255,128,64) transparent, the same opaque.
inline const std::string kTransparentPicture(
    "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x02\0\0\0\x01\x08\x06\0\0\0\xf4\x22\x7f\x8a\0\0\0\x0fIDAT\x78\xda\x63\xf8\xdf"
    "\xe0\xc0\0\xc4\xff\x01\x13\xfc\x04\x7e\xaf\x1b\x33\x47\0\0\0\0IEND\xae\x42\x60\x82",
    72);
// 2 x 1 RGBA as lossless WebP, of one colour and half transparent. Made with oiiotool.
inline const std::string kWebpPicture(
    "\x52\x49\x46\x46\x18\x00\x00\x00\x57\x45\x42\x50\x56\x50\x38\x4c"
    "\x0c\x00\x00\x00\x2f\x01\x00\x00\x10\x28\x51\x5f\x6b\x52\xc0\x00",
    32);
}  // namespace rcs::test
