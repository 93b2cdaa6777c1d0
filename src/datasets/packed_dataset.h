// SPDX-License-Identifier: MIT
// Inside of the room: a data set whose frames lie one behind the other in one large file. Each format reads
// its headers into the list; reading, checking and decoding of the images are the same for all.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "capture/dataset.h"
#include "datasets/camera_file.h"
#include "datasets/random_file.h"

namespace burin {

struct PackedImage {
    std::uint64_t offset = 0;
    std::uint32_t bytes = 0;  // 0: none
};

struct PackedFrame {
    PackedImage depth, colour;
    std::int64_t t_ns = 0, colour_t_ns = 0;
    bool has_pose = false;
    Se3 T_world_camera;
};

struct PackedList {
    const char* format = "";
    RandomFile file;
    std::vector<PackedFrame> frames;
    CameraFile cameras;              // complete: sizes too
    bool raw_depth_by_size = false;  // depth is raw where it has just the bytes of the pixels, else zlib
    bool raw_depth = false;          // depth is raw; otherwise zlib
    bool raw_colour = false;         // colour is RGB bytes; otherwise, and where it has other than just the
                                     // bytes of the pixels, JPEG or PNG
    bool swap_red_blue = false;      // of coded colour
    std::string notes;               // lines, each ended by '\n'
};

// Little-endian u16 depth, colour as 8-bit RGB. Checks that there are frames and the cameras.
Result<std::unique_ptr<Dataset>> make_packed_dataset(PackedList list);

// Decodes the depth of one frame: raw or zlib. Pure, for the fuzzer.
Status decode_packed_depth(std::string_view bytes, bool raw, const std::string& name, int width, int height,
                           Image<std::uint16_t>* out);

// No image in such a file is larger: raw colour of 4096 x 4096 pixels.
inline constexpr std::uint32_t kMaxPackedImage = 4096u * 4096 * 3;

// Stamps that do not rise are replaced by those of 30 Hz, and a note says so.
void mend_stamps(PackedList* list);
void note_missing_poses(PackedList* list, const char* why);

}  // namespace burin
