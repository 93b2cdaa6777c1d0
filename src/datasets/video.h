// SPDX-License-Identifier: MIT
// Pictures of a video by number, where FFmpeg's libraries were there at build time (BURIN_HAVE_VIDEO).
#pragma once

#include <memory>
#include <string>

#include "core/image.h"
#include "core/status.h"

namespace burin {

class Video {
  public:
    virtual ~Video() = default;
    virtual int frame_count() const = 0;
    virtual int width() const = 0;
    virtual int height() const = 0;
    // The picture as 8-bit RGB, counted by time of display. Safe from several threads, which take turns: the
    // codec goes forward from where it stands, the last pictures are kept for threads that come out of order,
    // and a jump goes to the key picture before. Error: a damaged file; *out is then empty.
    virtual Status load(int index, Image<std::uint8_t>* out) = 0;
};

// Reads the stamps of all pictures, which does not decode any. Error (unsupported): built without FFmpeg.
Result<std::unique_ptr<Video>> open_video(const std::string& path);
bool video_is_built();

}  // namespace burin
