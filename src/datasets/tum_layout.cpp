// SPDX-License-Identifier: MIT
#include "datasets/tum_layout.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <tuple>
#include <utility>

#include "datasets/file.h"
#include "datasets/imu_file.h"
#include "datasets/trajectory_file.h"

namespace burin {
namespace {

// The names under which the list of pairs is handed around.
constexpr const char* kAssociationNames[] = {"associations.txt", "association.txt", "associated.txt",
                                             "associate.txt"};

std::string association_file(const std::string& folder) {
    for (const char* name : kAssociationNames)
        if (const std::string path = folder + "/" + name; is_file(path)) return path;
    return {};
}

bool says_depth(std::string_view file) {
    constexpr std::string_view kDepth = "depth";
    return std::search(file.begin(), file.end(), kDepth.begin(), kDepth.end(), [](char a, char b) {
               return std::tolower(static_cast<unsigned char>(a)) == b;
           }) != file.end();
}

Status take_stamp(std::string_view word, const std::string& name, int line, std::int64_t* t_ns) {
    if (parse_seconds(word, t_ns)) return {};
    return Status::error(Code::format, "%s:%d: time stamp is '%s', expected seconds within +-9.2e9",
                         name.c_str(), line, printable(word).c_str());
}

Status check_rising(std::int64_t t_ns, std::int64_t before_ns, const std::string& name, int line) {
    if (t_ns > before_ns) return {};
    return Status::error(Code::format, "%s:%d: time stamp %s is not after %s, expected rising stamps",
                         name.c_str(), line, format_seconds(t_ns).c_str(), format_seconds(before_ns).c_str());
}

Result<std::vector<StampedFile>> read_stamped_list(const std::string& path) {
    std::string text;
    BURIN_TRY(read_file(path, kMaxTextBytes, &text));
    return parse_stamped_list(text, path);
}

FrameFiles frame_of(const std::string& folder, const StampedFile* colour, const StampedFile& depth) {
    FrameFiles frame;
    frame.depth_path = folder + "/" + depth.file;
    frame.t_ns = depth.t_ns;
    // Burin's own addition, see convert.h.
    const std::string confidence = folder + "/confidence/" + depth.file.substr(depth.file.rfind('/') + 1);
    if (is_file(confidence)) frame.confidence_path = confidence;
    if (colour) frame.colour_path = folder + "/" + colour->file;
    frame.colour_t_ns = colour ? colour->t_ns : depth.t_ns;
    return frame;
}

}  // namespace

Result<std::vector<StampedFile>> parse_stamped_list(std::string_view text, const std::string& name) {
    std::vector<StampedFile> files;
    LineReader lines(text);
    std::string_view line;
    while (lines.next_content(&line)) {
        std::string_view words[2];
        const int count = split_words(line, words, 2);
        if (count != 2)
            return Status::error(Code::format, "%s:%d: %d words, expected 'seconds file'", name.c_str(),
                                 lines.number(), count);
        StampedFile file;
        BURIN_TRY(take_stamp(words[0], name, lines.number(), &file.t_ns));
        if (!files.empty()) BURIN_TRY(check_rising(file.t_ns, files.back().t_ns, name, lines.number()));
        file.file = words[1];
        files.push_back(std::move(file));
    }
    if (files.empty())
        return Status::error(Code::format, "%s: lists 0 images, expected lines 'seconds file'", name.c_str());
    return files;
}

Result<std::vector<StampedPair>> parse_associations(std::string_view text, const std::string& name) {
    std::vector<StampedPair> pairs;
    LineReader lines(text);
    std::string_view line;
    while (lines.next_content(&line)) {
        std::string_view words[4];
        const int count = split_words(line, words, 4);
        if (count != 4)
            return Status::error(Code::format,
                                 "%s:%d: %d words, expected 'seconds colour_file seconds depth_file'",
                                 name.c_str(), lines.number(), count);
        StampedPair pair;
        const bool depth_first = says_depth(words[1]) && !says_depth(words[3]);
        StampedFile& first = depth_first ? pair.depth : pair.colour;
        StampedFile& second = depth_first ? pair.colour : pair.depth;
        BURIN_TRY(take_stamp(words[0], name, lines.number(), &first.t_ns));
        BURIN_TRY(take_stamp(words[2], name, lines.number(), &second.t_ns));
        first.file = words[1];
        second.file = words[3];
        if (!pairs.empty())
            BURIN_TRY(check_rising(pair.depth.t_ns, pairs.back().depth.t_ns, name, lines.number()));
        pairs.push_back(std::move(pair));
    }
    if (pairs.empty())
        return Status::error(Code::format,
                             "%s: lists 0 pairs, expected 'seconds colour_file seconds depth_file'",
                             name.c_str());
    return pairs;
}

std::vector<StampedPair> pair_by_time(const std::vector<StampedFile>& colour,
                                      const std::vector<StampedFile>& depth) {
    struct Candidate {
        std::int64_t gap_ns;
        std::size_t depth, colour;
    };
    std::vector<Candidate> candidates;
    std::size_t first = 0;  // both lists rise, so the window only moves forward
    for (std::size_t d = 0; d < depth.size(); ++d) {
        while (first < colour.size() && colour[first].t_ns < depth[d].t_ns - kMaxPairGapNs) ++first;
        for (std::size_t c = first; c < colour.size() && colour[c].t_ns <= depth[d].t_ns + kMaxPairGapNs; ++c)
            candidates.push_back({std::abs(colour[c].t_ns - depth[d].t_ns), d, c});
    }
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
        return std::tie(a.gap_ns, a.depth, a.colour) < std::tie(b.gap_ns, b.depth, b.colour);
    });
    constexpr std::size_t kNone = static_cast<std::size_t>(-1);
    std::vector<std::size_t> colour_of(depth.size(), kNone);
    std::vector<bool> taken(colour.size(), false);
    for (const Candidate& candidate : candidates) {
        if (colour_of[candidate.depth] != kNone || taken[candidate.colour]) continue;
        colour_of[candidate.depth] = candidate.colour;
        taken[candidate.colour] = true;
    }
    std::vector<StampedPair> pairs;
    for (std::size_t d = 0; d < depth.size(); ++d)
        if (colour_of[d] != kNone) pairs.push_back({colour[colour_of[d]], depth[d]});
    return pairs;
}

bool has_tum_lists(const std::string& folder) {
    return !association_file(folder).empty() || is_file(folder + "/depth.txt");
}

Status read_tum_frames(FileList* list) {
    const std::string& folder = list->folder;
    if (const std::string path = association_file(folder); !path.empty()) {
        std::string text;
        BURIN_TRY(read_file(path, kMaxTextBytes, &text));
        Result<std::vector<StampedPair>> pairs = parse_associations(text, path);
        if (!pairs) return pairs.status();
        for (const StampedPair& pair : *pairs)
            list->frames.push_back(frame_of(folder, &pair.colour, pair.depth));
        return {};
    }
    Result<std::vector<StampedFile>> depth = read_stamped_list(folder + "/depth.txt");
    if (!depth) return depth.status();
    if (!is_file(folder + "/rgb.txt")) {
        for (const StampedFile& file : *depth) list->frames.push_back(frame_of(folder, nullptr, file));
        list->notes += "no rgb.txt: depth alone\n";
        return {};
    }
    Result<std::vector<StampedFile>> colour = read_stamped_list(folder + "/rgb.txt");
    if (!colour) return colour.status();
    const std::vector<StampedPair> pairs = pair_by_time(*colour, *depth);
    if (pairs.empty())
        return Status::error(
            Code::format, "%s: 0 of %zu depth images have a colour image within 20 ms, expected at least 1",
            folder.c_str(), depth->size());
    for (const StampedPair& pair : pairs) list->frames.push_back(frame_of(folder, &pair.colour, pair.depth));
    if (pairs.size() < depth->size())
        list->notes += std::to_string(depth->size() - pairs.size()) + " of " + std::to_string(depth->size()) +
                       " depth images left out: no colour image within 20 ms\n";
    return {};
}

Status read_tum_imu(FileList* list) {
    const std::string path = list->folder + "/imu.txt";
    if (!is_file(path)) return {};
    Result<std::vector<ImuSample>> imu = read_imu(path);
    if (!imu) return imu.status();
    list->imu = std::move(*imu);
    return {};
}

void assign_poses(const Trajectory& trajectory, FileList* list) {
    for (FrameFiles& frame : list->frames) {
        const MaybePose pose = pose_at(trajectory, frame.t_ns);
        frame.has_pose = pose.known;
        frame.T_world_camera = pose.T_world_camera;
    }
    note_missing_poses(list, "outside the ground truth, or in a gap of more than 100 ms");
}

}  // namespace burin
