#include "worker/small_picture.h"

#include "output/small_copy.h"
#include "rcs/error.h"
#include "rcs/image_io.h"

namespace rcs::service {

bool write_small_picture(const std::string& path, const Image& beauty, ToneMapper& mapper, ThreadPool& pool)
{
    constexpr int kSide = 320;  // [px]
    ImageFileOptions options;
    options.jpeg_quality = 80;
    try {
        write_display_image(path, mapper.apply(small_copy(beauty, kSide), pool), options);
        return true;
    } catch (const Error& e) {
        if (e.code() != ErrorCode::io) throw;
        return false;
    }
}

}  // namespace rcs::service
