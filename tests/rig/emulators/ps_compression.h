// SPDX-License-Identifier: MIT
// PrimeSense's compressed streams, written: nibbles, the high one of a byte first. (What reads them is
// OpenNI2's XnPSCompressedDepthProcessor and Uncomp.)
#pragma once

#include <cstdint>
#include <vector>

namespace rig {

class NibbleWriter {
  public:
    explicit NibbleWriter(std::vector<std::uint8_t>& out) : out_(out) { out_.clear(); }
    void put(int nibble) {
        if (half_)
            out_.back() = static_cast<std::uint8_t>(out_.back() | (nibble & 15));
        else
            out_.push_back(static_cast<std::uint8_t>((nibble & 15) << 4));
        half_ = !half_;
    }
    void finish() {
        if (half_) put(13);  // stands for nothing
    }

  private:
    std::vector<std::uint8_t>& out_;
    bool half_ = false;
};

// Depth: 0-c a difference of -6..6; e n the last value n + 1 times more; f and 8-f: a difference of seven
// bits; f and 0-7: a value of fifteen. at(x, y) is a shift.
template <class At>
void compress_depth(int width, int height, const At& at, std::vector<std::uint8_t>& out) {
    NibbleWriter writer(out);
    int last = 0, run = 0;
    bool begun = false;
    const auto end_run = [&] {
        if (run == 1) writer.put(6);  // one nibble instead of two
        if (run > 1) writer.put(14), writer.put(run - 1);
        run = 0;
    };
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const int value = static_cast<int>(at(x, y)), d = value - last;
            if (begun && d == 0) {
                if (++run == 16) end_run();
                continue;
            }
            end_run();
            if (begun && d >= -6 && d <= 6)
                writer.put(d + 6);
            else if (begun && d >= -64 && d <= 63)
                writer.put(15), writer.put(8 | (d + 64) >> 4), writer.put(d + 64);
            else
                writer.put(15), writer.put(value >> 12 & 7), writer.put(value >> 8), writer.put(value >> 4),
                    writer.put(value);
            last = value;
            begun = true;
        }
    end_run();
    writer.finish();
}

// Images: 0-c a difference of -6..6; f and two nibbles a value. Running values, one for each channel, begin
// at 0 in each row; both lumas of a pair share one. `columns`: bytes of a row.
inline void compress_image(const std::vector<std::uint8_t>& bytes, int columns, bool yuv,
                           std::vector<std::uint8_t>& out) {
    static constexpr int kYuvChannel[4] = {0, 1, 2, 1};
    NibbleWriter writer(out);
    int last[3] = {};
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        const int column = static_cast<int>(i % static_cast<std::size_t>(columns));
        const int channel = yuv ? kYuvChannel[column % 4] : column % 2;
        if (column == 0) last[0] = last[1] = last[2] = 0;
        const int d = bytes[i] - last[channel];
        if (d >= -6 && d <= 6)
            writer.put(d + 6);
        else
            writer.put(15), writer.put(bytes[i] >> 4), writer.put(bytes[i]);
        last[channel] = bytes[i];
    }
    writer.finish();
}

}  // namespace rig
