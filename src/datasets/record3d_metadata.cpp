// SPDX-License-Identifier: MIT
// Facts from the author's answers at github.com/marek-simonik/record3d: issues 27 and 33 (poses are qx qy qz
// qw px py pz, OpenGL's axes), 60 (K column by column), 83 (K is the first frame's; newer files have
// perFrameIntrinsicCoeffs fx fy cx cy), 93 (the files in the archive).
#include <cmath>
#include <nlohmann/json.hpp>

#include "datasets/arkit.h"
#include "datasets/record3d.h"

namespace burin {
namespace {

using nlohmann::json;

constexpr std::size_t kMostFrames = 10'000'000;  // days of video
constexpr double kMostSeconds = 9e9;             // what fits int64 nanoseconds

// The number at key; absent: *value stays.
Status take(const json& root, const char* key, double least, double most, const std::string& name,
            double* value) {
    const auto found = root.find(key);
    if (found == root.end() || found->is_null()) return {};
    const double number = found->is_number() ? found->get<double>() : NAN;
    if (!(number >= least && number <= most))
        return Status::error(Code::format, "%s: '%s' is no number in %g..%g, expected one", name.c_str(), key,
                             least, most);
    *value = number;
    return {};
}

Status take_side(const json& root, const char* key, const std::string& name, int* side) {
    double value = 0;
    BURIN_TRY(take(root, key, 1, kMaxImageSide, name, &value));
    *side = static_cast<int>(value);
    return {};
}

// `count` numbers of an array, all finite.
Status numbers_of(const json& array, std::size_t count, const char* what, std::size_t index,
                  const std::string& name, double* values) {
    if (array.is_array() && array.size() >= count) {
        std::size_t good = 0;
        while (good < count && array[good].is_number() && std::isfinite(array[good].get<double>())) {
            values[good] = array[good].get<double>();
            ++good;
        }
        if (good == count) return {};
    }
    return Status::error(Code::format, "%s: entry %zu of '%s' is not %zu finite numbers, expected these",
                         name.c_str(), index, what, count);
}

// The array at key; null when it is not there.
Result<const json*> array_at(const json& root, const char* key, const std::string& name) {
    const auto found = root.find(key);
    if (found == root.end() || found->is_null()) return static_cast<const json*>(nullptr);
    if (!found->is_array() || found->size() > kMostFrames)
        return Status::error(Code::format, "%s: '%s' is no array of at most %zu entries, expected one",
                             name.c_str(), key, kMostFrames);
    return &*found;
}

Status check(const Camera& camera, const std::string& name) {
    if (const Status status = check_camera(camera, "colour"); !status)
        return Status::error(Code::format, "%s: %s", name.c_str(), status.text());
    return {};
}

Status take_camera(const json& root, const std::string& name, Camera* camera) {
    double K[9];
    const auto found = root.find("K");
    if (found == root.end())
        return Status::error(Code::format, "%s: no 'K', expected the intrinsic matrix", name.c_str());
    BURIN_TRY(numbers_of(*found, 9, "K", 0, name, K));
    camera->fx = K[0], camera->fy = K[4], camera->cx = K[6], camera->cy = K[7];
    return check(*camera, name);
}

Status take_poses(const json& root, const std::string& name, Record3dMetadata* out) {
    const Result<const json*> poses = array_at(root, "poses", name);
    if (!poses) return poses.status();
    for (std::size_t i = 0; *poses && i < (*poses)->size(); ++i) {
        double v[7];
        BURIN_TRY(numbers_of((**poses)[i], 7, "poses", i, name, v));
        const Result<Se3> T = se3_from_quaternion({v[4], v[5], v[6]}, {v[0], v[1], v[2], v[3]});
        if (!T) return Status::error(Code::format, "%s: pose %zu: %s", name.c_str(), i, T.status().text());
        out->T_world_camera.push_back(opencv_from_arkit(*T));
    }
    return {};
}

Status take_intrinsics(const json& root, const std::string& name, Record3dMetadata* out) {
    const Result<const json*> list = array_at(root, "perFrameIntrinsicCoeffs", name);
    if (!list) return list.status();
    for (std::size_t i = 0; *list && i < (*list)->size(); ++i) {
        double v[4];
        BURIN_TRY(numbers_of((**list)[i], 4, "perFrameIntrinsicCoeffs", i, name, v));
        Camera camera = out->colour;
        camera.fx = v[0], camera.fy = v[1], camera.cx = v[2], camera.cy = v[3];
        BURIN_TRY(check(camera, name));
        out->colour_of_frame.push_back(camera);
    }
    return {};
}

Status take_stamps(const json& root, const std::string& name, Record3dMetadata* out) {
    const Result<const json*> list = array_at(root, "frameTimestamps", name);
    if (!list) return list.status();
    for (std::size_t i = 0; *list && i < (*list)->size(); ++i) {
        const json& entry = (**list)[i];
        const double seconds = entry.is_number() ? entry.get<double>() : NAN;
        const std::int64_t t_ns = std::fabs(seconds) < kMostSeconds ? std::llround(seconds * 1e9) : INT64_MIN;
        if (t_ns == INT64_MIN || (!out->t_ns.empty() && t_ns <= out->t_ns.back()))
            return Status::error(Code::format,
                                 "%s: entry %zu of 'frameTimestamps' is %g, expected rising seconds",
                                 name.c_str(), i, seconds);
        out->t_ns.push_back(t_ns);
    }
    return {};
}

}  // namespace

Result<Record3dMetadata> parse_record3d_metadata(std::string_view text, const std::string& name) try {
    const json root = json::parse(text.begin(), text.end(), nullptr, false);
    if (!root.is_object())
        return Status::error(Code::format, "%s: is no JSON object, expected Record3D's metadata",
                             name.c_str());
    Record3dMetadata out;
    BURIN_TRY(take_side(root, "w", name, &out.colour.width));
    BURIN_TRY(take_side(root, "h", name, &out.colour.height));
    BURIN_TRY(take_side(root, "dw", name, &out.depth_width));
    BURIN_TRY(take_side(root, "dh", name, &out.depth_height));
    BURIN_TRY(take(root, "fps", 0.01, 1000, name, &out.fps));
    BURIN_TRY(take_camera(root, name, &out.colour));
    BURIN_TRY(take_poses(root, name, &out));
    BURIN_TRY(take_intrinsics(root, name, &out));
    BURIN_TRY(take_stamps(root, name, &out));
    return out;
} catch (...) {
    return Status::error(Code::insufficient_memory, "%s: no memory to read it", name.c_str());
}

}  // namespace burin
