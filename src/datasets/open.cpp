// SPDX-License-Identifier: MIT
#include "datasets/open.h"

#include "datasets/file.h"
#include "datasets/formats.h"

namespace burin {
namespace {

struct Format {
    const char* name;
    bool (*looks_like)(const std::string& path);
    Result<std::unique_ptr<Dataset>> (*open)(const std::string& path);
    const char* wants;     // for the message when nothing fits
    bool is_file = false;  // one file; otherwise a folder
};

// In the order of asking. ICL-NUIM comes before TUM, whose layout it shares; slambook and replica before
// redwood, which takes any folder with depth/ and color/.
constexpr Format kFormats[] = {
    {"recording", looks_like_recording, open_recording, "recording.burinrec"},
    {"stray", looks_like_stray, open_stray, "odometry.csv and camera_matrix.csv"},
    {"polycam", looks_like_polycam, open_polycam, "keyframes/depth"},
    {"icl_nuim", looks_like_icl_nuim, open_icl_nuim, "*.gt.freiburg or scene_00_*.depth"},
    {"tum", looks_like_tum, open_tum, "associations.txt or depth.txt"},
    {"7scenes", looks_like_seven_scenes, open_seven_scenes, "frame-*.depth.png"},
    {"replica", looks_like_replica, open_replica, "results/depth*.png"},
    {"slambook", looks_like_slambook, open_slambook, "pose.txt"},
    {"redwood", looks_like_redwood, open_redwood, "depth/ and color/"},
    {"sens", looks_like_sens, open_sens, "a file .sens", true},
    {"klg", looks_like_klg, open_klg, "a file .klg", true},
#ifdef BURIN_HAVE_ZIP
    {"record3d", looks_like_record3d, open_record3d, "a file .r3d", true},
#endif
};

std::string format_names() {
    std::string names;
    for (const Format& format : kFormats) names += (names.empty() ? "" : ", ") + std::string(format.name);
    return names;
}

Result<std::unique_ptr<Dataset>> open_checked(const std::string& path, const std::string& wanted) {
    const bool file = is_file(path);
    if (!file && !is_folder(path))
        return Status::error(Code::io, "%s: is not there, expected the folder or the file of a data set",
                             path.c_str());
    // A trailing slash would double in every message.
    std::string folder = path;
    while (folder.size() > 1 && folder.back() == '/') folder.pop_back();
    for (const Format& format : kFormats) {
        if (wanted == format.name && format.is_file != file)
            return Status::error(Code::format, "%s: is a %s, expected a %s for format '%s'", path.c_str(),
                                 file ? "file" : "folder", format.is_file ? "file" : "folder", format.name);
        if (format.is_file == file && (wanted.empty() ? format.looks_like(folder) : wanted == format.name))
            return format.open(folder);
    }
    if (!wanted.empty())
        return Status::error(Code::invalid_argument, "format '%s' is unknown, expected one of %s",
                             printable(wanted).c_str(), format_names().c_str());
#ifndef BURIN_HAVE_ZIP
    if (has_ending(path, ".r3d"))
        return Status::error(Code::unsupported,
                             "%s: this build reads no Record3D: it was built without libzip", path.c_str());
#endif
    std::string wants;
    for (const Format& format : kFormats)
        if (format.is_file == file)
            wants += (wants.empty() ? "" : "; ") + std::string(format.name) + ": " + format.wants;
    return Status::error(Code::format, "%s: no known data set, expected one of %s", path.c_str(),
                         wants.c_str());
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
