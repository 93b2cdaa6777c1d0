// SPDX-License-Identifier: MIT
#include "datasets/open.h"

#include "datasets/file.h"
#include "datasets/formats.h"

namespace burin {
namespace {

struct Format {
    const char* name;
    bool (*looks_like)(const std::string& folder);
    Result<std::unique_ptr<Dataset>> (*open)(const std::string& folder);
    const char* wants;  // for the message when nothing fits
};

// In the order of asking. ICL-NUIM comes before TUM, whose layout it shares; slambook and replica before
// redwood, which takes any folder with depth/ and color/.
constexpr Format kFormats[] = {
    {"recording", looks_like_recording, open_recording, "recording.burinrec"},
    {"icl_nuim", looks_like_icl_nuim, open_icl_nuim, "*.gt.freiburg or scene_00_*.depth"},
    {"tum", looks_like_tum, open_tum, "associations.txt or depth.txt"},
    {"7scenes", looks_like_seven_scenes, open_seven_scenes, "frame-*.depth.png"},
    {"replica", looks_like_replica, open_replica, "results/depth*.png"},
    {"slambook", looks_like_slambook, open_slambook, "pose.txt"},
    {"redwood", looks_like_redwood, open_redwood, "depth/ and color/"},
};

std::string format_names() {
    std::string names;
    for (const Format& format : kFormats) names += (names.empty() ? "" : ", ") + std::string(format.name);
    return names;
}

Result<std::unique_ptr<Dataset>> open_checked(const std::string& path, const std::string& wanted) {
    if (!is_folder(path))
        return Status::error(Code::io, "%s: is not there or is no folder, expected the folder of a data set",
                             path.c_str());
    // A trailing slash would double in every message.
    std::string folder = path;
    while (folder.size() > 1 && folder.back() == '/') folder.pop_back();
    for (const Format& format : kFormats)
        if (wanted.empty() ? format.looks_like(folder) : wanted == format.name) return format.open(folder);
    if (!wanted.empty())
        return Status::error(Code::invalid_argument, "format '%s' is unknown, expected one of %s",
                             printable(wanted).c_str(), format_names().c_str());
    std::string wants;
    for (const Format& format : kFormats)
        wants += (wants.empty() ? "" : "; ") + std::string(format.wants) + " (" + format.name + ")";
    return Status::error(Code::format, "%s: no known data set, expected %s", path.c_str(), wants.c_str());
}

}  // namespace

std::vector<std::string> dataset_formats() {
    std::vector<std::string> names;
    for (const Format& format : kFormats) names.emplace_back(format.name);
    return names;
}

Result<std::unique_ptr<Dataset>> open_dataset(const std::string& path, const std::string& format) {
    try {
        return open_checked(path, format);
    } catch (...) {
        return Status::error(Code::insufficient_memory, "%s: no memory to open it", path.c_str());
    }
}

}  // namespace burin
