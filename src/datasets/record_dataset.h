// SPDX-License-Identifier: MIT
// Any data set into a recording.
#pragma once

#include <functional>
#include <string>

#include "capture/dataset.h"
#include "capture/recording_writer.h"

namespace burin {

struct RecordDatasetOptions {
    int begin = 0, end = 1000000000;  // frames begin .. end-1, as far as there are any
    RecordedColour colour = RecordedColour::jpeg;
    int jpeg_quality = 90;
};

// Writes `folder`, waits for the disk at the end. Depth, poses, intrinsics, stamps and readings of the IMU
// come out of the recording bit for bit; colour does when it is lossless or raw. Depth in metres as floating
// point (ICL-NUIM's .depth) is rounded to fifths of a millimetre. progress(done, total): false ends the
// recording in order after that frame. source: for the header. Errors: those of the data set and the
// recorder; format: frames differ in size or in the extrinsic.
Status record_dataset(const Dataset& dataset, const std::string& folder, const std::string& source,
                      const RecordDatasetOptions& options, const std::function<bool(int, int)>& progress,
                      RecordingStatistics* statistics);

}  // namespace burin
