// SPDX-License-Identifier: MIT
// Any data set into the TUM layout.
#pragma once

#include <functional>
#include <string>

#include "capture/dataset.h"

namespace burin {

struct ConvertOptions {
    int begin = 0, end = 1000000000;  // frames begin .. end-1, as far as there are any
    bool colour = true;
};

struct ConvertSummary {
    int frames = 0, with_colour = 0, with_pose = 0, with_confidence = 0;
    std::string notes;  // what the layout cannot hold, lines, each ended by '\n'
};

// Writes folder/depth/NNNNNN.png (16 bits), rgb/NNNNNN.png, associations.txt (depth.txt and rgb.txt when not
// every frame has colour), groundtruth.txt, camera.txt with the depth scale, imu.txt, confidence/NNNNNN.png;
// the folder must not exist or be empty. Depth of 16 bits, colour, stamps and confidence come back bit for
// bit, poses and readings of the IMU to the last digits of doubles. Floating-point depth is rounded to fifths
// of a millimetre, none beyond 13.1 m. The lists are written last: an unfinished folder is no data set.
// progress(done, total): false ends it in order after that frame. Errors: those of the data set, io, and
// format: frames differ in size, unit or extrinsic.
Status convert_to_tum(const Dataset& dataset, const std::string& folder, const ConvertOptions& options,
                      const std::function<bool(int, int)>& progress, ConvertSummary* summary);

}  // namespace burin
