// SPDX-License-Identifier: MIT
#include "datasets/video.h"

namespace burin {

bool video_is_built() { return false; }

Result<std::unique_ptr<Video>> open_video(const std::string& path) {
    return Status::error(Code::unsupported,
                         "%s: this build reads no video: it was built without FFmpeg's libraries",
                         path.c_str());
}

}  // namespace burin
