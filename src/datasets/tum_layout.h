// SPDX-License-Identifier: MIT
// The lists of the TUM RGB-D layout, which ICL-NUIM shares: rgb.txt and depth.txt (`t file`),
// associations.txt
// (`t file t file`), imu.txt, and poses by time stamp.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/trajectory.h"
#include "datasets/file_dataset.h"

namespace burin {

struct StampedFile {
    std::int64_t t_ns = 0;
    std::string file;  // relative to the folder of the list
};
// `t file` a line, stamps rising, at least one line.
Result<std::vector<StampedFile>> parse_stamped_list(std::string_view text, const std::string& name);

struct StampedPair {
    StampedFile colour, depth;
};
// `t file t file` a line. The order differs between tools; the file whose path says "depth" is the depth
// image, and colour stands first when neither or both say so. Depth stamps rise. At least one line.
Result<std::vector<StampedPair>> parse_associations(std::string_view text, const std::string& name);

// Colour and depth of the recordings are at most this far apart (the benchmark's associate.py).
inline constexpr std::int64_t kMaxPairGapNs = 20'000'000;
// One to one, the closest pairs first, as the benchmark's tool does; in order of the depth stamps.
std::vector<StampedPair> pair_by_time(const std::vector<StampedFile>& colour,
                                      const std::vector<StampedFile>& depth);

// True when the folder has one of the lists.
bool has_tum_lists(const std::string& folder);
// Reads the lists of list->folder into list->frames, without poses. Depth alone (no rgb.txt) is taken as it
// is.
Status read_tum_frames(FileList* list);
// imu.txt of list->folder into list->imu, where there is one. Its extrinsic stands in camera.txt.
Status read_tum_imu(FileList* list);
// Gives each frame the pose at its depth stamp, see pose_at.
void assign_poses(const Trajectory& trajectory, FileList* list);

}  // namespace burin
