#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "image/image_reader.h"

namespace rcs {

/// A reader that decodes row after row, of 8 or 16 bit samples.
class RowReader : public ImageReader {
public:
    bool read_rows(int begin, int end, int channels, SampleType type, void* samples) override
    {
        const std::size_t stored = static_cast<std::size_t>(spec_.channels),
                          wanted = static_cast<std::size_t>(channels);
        auto* to = static_cast<std::uint8_t*>(samples);
        for (int y = begin; y < end; ++y) {
            if (y != next_) {
                why_ = "rows are read in order";
                return false;
            }
            const std::uint8_t* row = decode_next();
            if (!row) return false;
            ++next_;
            const std::size_t values = static_cast<std::size_t>(spec_.width) * stored;
            if (wanted == stored && type == spec_.type) {
                const std::size_t bytes = values * (type == SampleType::uint16 ? 2 : 1);
                std::memcpy(to, row, bytes);
                to += bytes;
                continue;
            }
            for (std::size_t pixel = 0; pixel < values; pixel += stored)
                for (std::size_t c = 0; c < wanted; ++c) to = put(row, pixel + c, type, to);
        }
        return true;
    }

    std::string error() override { return why_; }

protected:
    /// @return the row, samples as the file has them; null: why_ says the reason
    virtual const std::uint8_t* decode_next() = 0;

    std::string why_;

private:
    std::uint8_t* put(const std::uint8_t* row, std::size_t i, SampleType type, std::uint8_t* to) const
    {
        std::uint16_t wide = 0;
        const bool is_wide = spec_.type == SampleType::uint16;
        if (is_wide)
            std::memcpy(&wide, row + 2 * i, sizeof wide);
        else
            wide = row[i];
        switch (type) {
            case SampleType::uint8:
                *to = static_cast<std::uint8_t>(is_wide ? (wide + 128) / 257 : wide);
                return to + 1;
            case SampleType::uint16:
                wide = static_cast<std::uint16_t>(is_wide ? wide : wide * 257);
                std::memcpy(to, &wide, sizeof wide);
                return to + sizeof wide;
            default: {
                const float real = static_cast<float>(wide) * (1.0f / (is_wide ? 65535.0f : 255.0f));
                std::memcpy(to, &real, sizeof real);
                return to + sizeof real;
            }
        }
    }

    int next_ = 0;
};

}  // namespace rcs
