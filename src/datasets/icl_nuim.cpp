// SPDX-License-Identifier: MIT
// ICL-NUIM (Handa, Whelan, McDonald, Davison, ICRA 2014) as it is handed out:
//  - TUM-compatible PNGs: rgb/, depth/, associations.txt and traj*.gt.freiburg or livingRoom*.gt.freiburg,
//  metres =
//    value / 5000, stamps are frame numbers, poses for fy = -480;
//  - the same folder with a groundtruth.txt, which people ship in either convention: the depth images decide;
//  - POV-Ray's own files: scene_00_%04d.png, .depth (text, length along the ray in metres), .txt (camera).
#include "datasets/icl_nuim.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <utility>

#include "datasets/file.h"
#include "datasets/file_dataset.h"
#include "datasets/formats.h"
#include "datasets/image_file.h"
#include "datasets/trajectory_file.h"
#include "datasets/tum_layout.h"

namespace burin {
namespace {

constexpr double kDepthScale = 5000;
constexpr Camera kCamera{640, 480, 481.2, 480, 319.5, 239.5};  // the set's page, with fy turned positive

constexpr std::string_view kPovPrefix = "scene_00_", kPovEnd = ".depth";

bool ends_with(std::string_view text, std::string_view end) {
    return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

bool is_pov_name(std::string_view name) {
    return name.substr(0, kPovPrefix.size()) == kPovPrefix && ends_with(name, kPovEnd);
}

// traj2.gt.freiburg, livingRoom2.gt.freiburg; empty when there is none.
std::string freiburg_file(const std::string& folder) {
    for (const std::string& name : list_folder(folder))
        if (ends_with(name, ".gt.freiburg")) return folder + "/" + name;
    return {};
}

bool has_pov_files(const std::string& folder) {
    const std::vector<std::string> names = list_folder(folder);
    return std::any_of(names.begin(), names.end(), [](const std::string& name) { return is_pov_name(name); });
}

// Says how badly two frames disagree under a convention: the median |z| difference of frame a's points moved
// into frame b, metres; negative when too little overlaps to tell.
double disagreement(const Image<std::uint16_t>& a, const Image<std::uint16_t>& b, const Se3& T_b_a,
                    const CameraFile& cameras) {
    constexpr int kStep = 4;  // every fourth pixel each way: 19,200 samples
    constexpr std::size_t kEnough = 1000;
    const double unit = 1 / cameras.depth_scale;
    std::vector<double> errors;
    for (int y = 0; y < a.height; y += kStep)
        for (int x = 0; x < a.width; x += kStep) {
            const double z = a.view().at(x, y) * unit;
            if (z <= 0) continue;
            const Vec3d p = T_b_a * (unproject(cameras.depth, {double(x), double(y)}) * z);
            if (!(p.z > 0)) continue;
            const Pixel pixel = project(cameras.depth, p);
            if (!(pixel.u > -0.5 && pixel.v > -0.5 && pixel.u < b.width - 0.5 && pixel.v < b.height - 0.5))
                continue;
            const double there = b.view().at(int(std::lround(pixel.u)), int(std::lround(pixel.v))) * unit;
            if (there > 0) errors.push_back(std::fabs(p.z - there));
        }
    if (errors.size() < kEnough) return -1;
    const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
    std::nth_element(errors.begin(), middle, errors.end());
    return *middle;
}

Trajectory converted(Trajectory trajectory) {
    for (StampedPose& pose : trajectory) pose.T_world_camera = opencv_from_icl(pose.T_world_camera);
    return trajectory;
}

// True when the poses in list->frames fit the depth images better after opencv_from_icl. Looks at up to four
// pairs from the start of the sequence, ten frames apart: far enough to move by centimetres, near enough to
// overlap.
Result<bool> poses_are_flipped(const FileList& list) {
    constexpr std::size_t kApart = 10, kPairs = 4;
    std::vector<const FrameFiles*> known;
    for (const FrameFiles& frame : list.frames)
        if (frame.has_pose) known.push_back(&frame);
    const std::size_t apart = std::min(kApart, known.empty() ? 0 : known.size() - 1);
    double as_is = 0, flipped = 0;
    for (std::size_t i = 0; apart > 0 && i < kPairs && (i + 1) * apart < known.size(); ++i) {
        const FrameFiles &fa = *known[i * apart], &fb = *known[(i + 1) * apart];
        Image<std::uint16_t> a, b;
        BURIN_TRY(read_depth(fa.depth_path, &a));
        BURIN_TRY(read_depth(fb.depth_path, &b));
        const Se3 T = fb.T_world_camera.inverse() * fa.T_world_camera;
        const Se3 T_flipped =
            opencv_from_icl(fb.T_world_camera).inverse() * opencv_from_icl(fa.T_world_camera);
        const double e = disagreement(a, b, T, list.cameras),
                     e_flipped = disagreement(a, b, T_flipped, list.cameras);
        if (e < 0 || e_flipped < 0) continue;
        as_is += e;
        flipped += e_flipped;
    }
    return flipped < as_is;
}

Status read_camera(FileList* list) {
    if (const std::string path = list->folder + "/camera.txt"; is_file(path)) {
        Result<CameraFile> file = read_camera_text(path, true);
        if (!file) return file.status();
        list->cameras = *file;
        list->cameras.depth.fy = std::fabs(file->depth.fy);
    } else {
        list->cameras.depth = list->cameras.colour = kCamera;
    }
    if (list->cameras.depth_scale == 0) list->cameras.depth_scale = kDepthScale;
    return {};
}

Status read_poses(FileList* list) {
    const std::string freiburg = freiburg_file(list->folder);
    const std::string path = freiburg.empty() ? list->folder + "/groundtruth.txt" : freiburg;
    if (!is_file(path)) {
        note_missing_poses(list, "neither *.gt.freiburg nor groundtruth.txt");
        return {};
    }
    Result<Trajectory> truth = read_tum_trajectory(path);
    if (!truth) return truth.status();
    bool flip = !freiburg.empty();
    if (!flip) {
        FileList trial = *list;
        assign_poses(*truth, &trial);
        Result<bool> flipped = poses_are_flipped(trial);
        if (!flipped) return flipped.status();
        flip = *flipped;
    }
    list->notes += flip ? "poses in ICL-NUIM's own convention (fy = -480), converted\n"
                        : "poses already fit fy = +480\n";
    assign_poses(flip ? converted(std::move(*truth)) : *truth, list);
    return {};
}

Status read_pov_frames(FileList* list) {
    for (const std::string& name : list_folder(list->folder)) {
        if (!is_pov_name(name)) continue;
        const std::string stem = list->folder + "/" + name.substr(0, name.size() - kPovEnd.size());
        const std::int64_t number = first_number(std::string_view(name).substr(kPovPrefix.size()));
        FrameFiles frame;
        frame.depth_path = list->folder + "/" + name;
        if (is_file(stem + ".png")) frame.colour_path = stem + ".png";
        frame.t_ns = frame.colour_t_ns = stamp_at_30_hz(number);
        if (number < 0 || (!list->frames.empty() && frame.t_ns <= list->frames.back().t_ns))
            return Status::error(
                Code::format,
                "%s: its number does not come after the one before, expected scene_00_%%04d.depth",
                frame.depth_path.c_str());
        if (const std::string path = stem + ".txt"; is_file(path)) {
            std::string text;
            BURIN_TRY(read_file(path, kMaxTextBytes, &text));
            Result<Se3> pose = parse_povray_camera(text, path);
            if (!pose) return pose.status();
            frame.has_pose = true;
            frame.T_world_camera = *pose;
        }
        list->frames.push_back(std::move(frame));
    }
    list->cameras.depth = list->cameras.colour = kCamera;
    list->cameras.depth_scale = 1;  // the text is in metres
    note_missing_poses(list, "no scene_00_*.txt");
    return {};
}

}  // namespace

Se3 opencv_from_icl(const Se3& T) {
    Se3 out = T;
    for (int i : {0, 2}) {
        out.R(1, i) = -T.R(1, i);
        out.R(i, 1) = -T.R(i, 1);
    }
    out.t.y = -T.t.y;
    return out;
}

Result<Se3> parse_povray_camera(std::string_view text, const std::string& name) {
    constexpr const char* kKeys[] = {"cam_pos", "cam_dir", "cam_up"};
    Vec3d values[3];
    for (int k = 0; k < 3; ++k) {
        LineReader lines(text);
        std::string_view line;
        const std::string_view key = kKeys[k];
        bool found = false;
        while (!found && lines.next(&line)) {
            // The whole key: cam_up must not match cam_upper.
            if (line.substr(0, key.size()) != key) continue;
            if (line.size() > key.size() && std::isalnum(static_cast<unsigned char>(line[key.size()])))
                continue;
            const std::size_t open = line.find('['), close = line.find(']');
            std::string list(open < close && close != std::string_view::npos
                                 ? line.substr(open + 1, close - open - 1)
                                 : "");
            std::replace(list.begin(), list.end(), ',', ' ');
            std::string_view words[3];
            bool ok = split_words(list, words, 3) == 3;
            for (int i = 0; ok && i < 3; ++i)
                ok = parse_number(words[i], &values[k][i]) && std::fabs(values[k][i]) < 1e6;
            if (!ok)
                return Status::error(Code::format, "%s:%d: '%s', expected %s = [x, y, z]", name.c_str(),
                                     lines.number(), printable(line).c_str(), kKeys[k]);
            found = true;
        }
        if (!found)
            return Status::error(Code::format, "%s: no %s, expected cam_pos, cam_dir and cam_up",
                                 name.c_str(), kKeys[k]);
    }
    const Vec3d z = normalised(values[1]);
    const Vec3d x = normalised(cross(values[2], z));
    const Vec3d y = cross(z, x);
    const double matrix[12] = {x.x, y.x,         z.x, values[0].x, x.y, y.y,
                               z.y, values[0].y, x.z, y.z,         z.z, values[0].z};
    Result<Se3> T = se3_from_matrix(matrix, 3);
    if (!T)
        return Status::error(
            Code::format, "%s: cam_dir and cam_up are parallel or 0, expected two directions", name.c_str());
    return opencv_from_icl(*T);
}

bool looks_like_icl_nuim(const std::string& folder) {
    if (has_pov_files(folder)) return true;
    if (!has_tum_lists(folder)) return false;
    if (!freiburg_file(folder).empty()) return true;
    // The camera says it: fy = -480.
    if (const std::string path = folder + "/camera.txt"; is_file(path)) {
        const Result<CameraFile> file = read_camera_text(path, true);
        return file && file->depth.fy < 0;
    }
    // The names under which the sequences are handed out.
    std::string name = folder_name(folder);
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    for (const char* part : {"icl", "frei_png", "living_room", "livingroom", "office_room"})
        if (name.find(part) != std::string::npos) return true;
    return false;
}

Result<std::unique_ptr<Dataset>> open_icl_nuim(const std::string& folder) {
    FileList list;
    list.format = "icl_nuim";
    list.folder = folder;
    if (has_pov_files(folder)) {
        BURIN_TRY(read_pov_frames(&list));
        return make_file_dataset(std::move(list));
    }
    if (!has_tum_lists(folder))
        return Status::error(Code::format,
                             "%s: neither associations.txt nor scene_00_*.depth, expected ICL-NUIM",
                             folder.c_str());
    BURIN_TRY(read_camera(&list));
    BURIN_TRY(read_tum_frames(&list));
    BURIN_TRY(read_tum_imu(&list));
    BURIN_TRY(read_poses(&list));
    return make_file_dataset(std::move(list));
}

}  // namespace burin
