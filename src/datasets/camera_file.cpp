// SPDX-License-Identifier: MIT
#include "datasets/camera_file.h"

#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "datasets/file.h"

namespace burin {
namespace {

// A calibration has a few hundred bytes.
constexpr std::size_t kMaxCameraBytes = 1 << 20;

// The keys of one camera in camera.txt, and where they go.
struct CameraKey {
    const char* key;
    double Camera::*value;
};
constexpr CameraKey kCameraKeys[] = {{"fx", &Camera::fx}, {"fy", &Camera::fy}, {"cx", &Camera::cx},
                                     {"cy", &Camera::cy}, {"k1", &Camera::k1}, {"k2", &Camera::k2},
                                     {"p1", &Camera::p1}, {"p2", &Camera::p2}, {"k3", &Camera::k3}};
constexpr int kKeyCount = static_cast<int>(std::size(kCameraKeys));
constexpr int kNeeded = 4;  // fx fy cx cy

// What a text said about one camera: bit i of `seen` stands for kCameraKeys[i].
struct Said {
    Camera camera;
    unsigned seen = 0;
};

Status check_positive(double value, const char* where, std::string_view key) {
    if (value > 0 && std::isfinite(value)) return {};
    return Status::error(Code::format, "%s: %.*s is %g, expected a positive number", where, int(key.size()),
                         key.data(), value);
}

Status check_side(double value, const char* where, std::string_view key) {
    if (value >= 1 && value <= kMaxImageSide && value == std::floor(value)) return {};
    return Status::error(Code::format, "%s: %.*s is %g, expected a whole number of pixels in 1..%d", where,
                         int(key.size()), key.data(), value, kMaxImageSide);
}

// Takes the key when it belongs to a camera. *known stays false when it does not.
Status take_camera_key(std::string_view key, double value, const char* where, bool flipped_fy, Said* said,
                       bool* known) {
    if (key == "width" || key == "height") {
        int& side = key == "width" ? said->camera.width : said->camera.height;
        if (side != 0)
            return Status::error(Code::format, "%s: a second %.*s, expected one", where, int(key.size()),
                                 key.data());
        BURIN_TRY(check_side(value, where, key));
        side = static_cast<int>(value);
        *known = true;
        return {};
    }
    for (int i = 0; i < kKeyCount; ++i) {
        if (key != kCameraKeys[i].key) continue;
        if (said->seen & (1u << i))
            return Status::error(Code::format, "%s: a second %s, expected one", where, kCameraKeys[i].key);
        if (!std::isfinite(value))
            return Status::error(Code::format, "%s: %s is %g, expected a finite number", where,
                                 kCameraKeys[i].key, value);
        if (i < 2) BURIN_TRY(check_positive(i == 1 && flipped_fy ? std::fabs(value) : value, where, key));
        said->camera.*kCameraKeys[i].value = value;
        said->seen |= 1u << i;
        *known = true;
        return {};
    }
    return {};
}

// `KEY tx ty tz qx qy qz qw`, once.
Status take_extrinsic(const std::string_view* words, int count, const char* where, bool* seen, Se3* T) {
    const std::string key(words[0]);
    if (count != 8 || *seen)
        return Status::error(Code::format, "%s: %s with %d values, expected it once with 7", where,
                             key.c_str(), count - 1);
    double v[7];
    for (int i = 0; i < 7; ++i)
        if (!parse_number(words[i + 1], &v[i]))
            return Status::error(Code::format, "%s: '%s' is no number, expected %s tx ty tz qx qy qz qw",
                                 where, printable(words[i + 1]).c_str(), key.c_str());
    const Result<Se3> read = se3_from_quaternion({v[0], v[1], v[2]}, {v[3], v[4], v[5], v[6]});
    if (!read)
        return Status::error(Code::format, "%s: %s, expected a rigid %s", where, read.status().text(),
                             key.c_str());
    *T = *read;
    *seen = true;
    return {};
}

}  // namespace

Result<CameraFile> parse_camera_text(std::string_view text, const std::string& name, bool allow_flipped_fy) {
    CameraFile file;
    Said depth, colour;
    bool has_extrinsic = false, has_imu = false;
    LineReader lines(text);
    std::string_view line;
    while (lines.next_content(&line)) {
        const std::string at = name + ":" + std::to_string(lines.number());
        const char* where = at.c_str();
        std::string_view words[8];
        const int count = split_words(line, words, 8);
        const std::string_view key = words[0];
        if (key == "T_colour_depth" || key == "T_camera_imu") {
            const bool imu = key == "T_camera_imu";
            BURIN_TRY(take_extrinsic(words, count, where, imu ? &has_imu : &has_extrinsic,
                                     imu ? &file.T_camera_imu : &file.T_colour_depth));
            continue;
        }
        double value = 0;
        if (count != 2 || !parse_number(words[1], &value))
            return Status::error(Code::format, "%s: '%s', expected 'key value' with a number", where,
                                 printable(line).c_str());
        bool known = false;
        if (key == "depth_scale") {
            if (file.depth_scale != 0)
                return Status::error(Code::format, "%s: a second depth_scale, expected one", where);
            BURIN_TRY(check_positive(value, where, key));
            file.depth_scale = value;
            known = true;
        } else if (key.substr(0, 7) == "colour_") {
            BURIN_TRY(take_camera_key(key.substr(7), value, where, false, &colour, &known));
        } else {
            BURIN_TRY(take_camera_key(key, value, where, allow_flipped_fy, &depth, &known));
        }
        if (!known)
            return Status::error(
                Code::format,
                "%s: unknown key '%s', expected fx fy cx cy width height depth_scale k1 k2 p1 p2 k3, "
                "colour_*, T_colour_depth or T_camera_imu",
                where, printable(key).c_str());
    }
    for (int i = 0; i < kNeeded; ++i)
        if (!(depth.seen & (1u << i)))
            return Status::error(Code::format, "%s: no %s, expected fx fy cx cy", name.c_str(),
                                 kCameraKeys[i].key);
    file.depth = depth.camera;
    file.colour = depth.camera;
    file.colour.fy = std::fabs(file.colour.fy);
    for (int i = 0; i < kKeyCount; ++i)
        if (colour.seen & (1u << i)) file.colour.*kCameraKeys[i].value = colour.camera.*kCameraKeys[i].value;
    if (colour.camera.width != 0) file.colour.width = colour.camera.width;
    if (colour.camera.height != 0) file.colour.height = colour.camera.height;
    return file;
}

Result<CameraFile> parse_intrinsic_matrix(std::string_view text, const std::string& name) {
    double m[9];
    int have = 0;
    LineReader lines(text);
    std::string_view line;
    while (lines.next_content(&line)) {
        std::string_view words[9];
        const int count = split_words(line, words, 9);
        for (int i = 0; i < count; ++i)
            if (have == 9 || !parse_number(words[i], &m[have++]))
                return Status::error(Code::format, "%s:%d: '%s', expected the 9 numbers of a 3x3 matrix",
                                     name.c_str(), lines.number(), printable(line).c_str());
    }
    if (have != 9)
        return Status::error(Code::format, "%s: %d numbers, expected the 9 of a 3x3 matrix", name.c_str(),
                             have);
    const bool bottom = m[6] == 0 && m[7] == 0 && m[8] == 1;
    if (m[1] != 0 || m[3] != 0 || !bottom || !std::isfinite(m[2]) || !std::isfinite(m[5]))
        return Status::error(Code::format,
                             "%s: the matrix is no pinhole camera, expected fx 0 cx / 0 fy cy / 0 0 1",
                             name.c_str());
    BURIN_TRY(check_positive(m[0], name.c_str(), "fx"));
    BURIN_TRY(check_positive(m[4], name.c_str(), "fy"));
    CameraFile file;
    file.depth = {0, 0, m[0], m[4], m[2], m[5]};
    file.colour = file.depth;
    return file;
}

namespace {

using nlohmann::json;

// The library reports by return values here; what could still throw is memory.
Result<json> parse_json(std::string_view text, const std::string& name) {
    try {
        json root = json::parse(text.begin(), text.end(), nullptr, false);
        if (root.is_object()) return root;
    } catch (...) {
        return Status::error(Code::insufficient_memory, "%s: no memory to read it", name.c_str());
    }
    return Status::error(Code::format, "%s: is no JSON object, expected camera parameters", name.c_str());
}

Status get_number(const json& object, const char* key, const std::string& name, double* value) {
    const auto found = object.find(key);
    if (found == object.end() || !found->is_number())
        return Status::error(Code::format, "%s: no number '%s', expected one", name.c_str(), key);
    *value = found->get<double>();
    return {};
}

Status get_size(const json& object, const char* w, const char* h, const std::string& name, Camera* camera) {
    double width = 0, height = 0;
    BURIN_TRY(get_number(object, w, name, &width));
    BURIN_TRY(get_number(object, h, name, &height));
    BURIN_TRY(check_side(width, name.c_str(), w));
    BURIN_TRY(check_side(height, name.c_str(), h));
    camera->width = static_cast<int>(width);
    camera->height = static_cast<int>(height);
    return {};
}

Result<CameraFile> finish(CameraFile file, const std::string& name) {
    if (const Status status = check_camera(file.depth, "depth"); !status)
        return Status::error(Code::format, "%s: %s", name.c_str(), status.text());
    file.colour = file.depth;
    return file;
}

template <class... Options>
Result<CameraFile> read_with(Result<CameraFile> (*parse)(std::string_view, const std::string&, Options...),
                             const std::string& path, Options... options) {
    std::string text;
    BURIN_TRY(read_file(path, kMaxCameraBytes, &text));
    return parse(text, path, options...);
}

}  // namespace

Result<CameraFile> parse_cam_params_json(std::string_view text, const std::string& name) {
    Result<json> root = parse_json(text, name);
    if (!root) return root.status();
    const auto found = root->find("camera");
    if (found == root->end() || !found->is_object())
        return Status::error(Code::format, "%s: no object 'camera', expected one with w h fx fy cx cy scale",
                             name.c_str());
    CameraFile file;
    BURIN_TRY(get_size(*found, "w", "h", name, &file.depth));
    BURIN_TRY(get_number(*found, "fx", name, &file.depth.fx));
    BURIN_TRY(get_number(*found, "fy", name, &file.depth.fy));
    BURIN_TRY(get_number(*found, "cx", name, &file.depth.cx));
    BURIN_TRY(get_number(*found, "cy", name, &file.depth.cy));
    BURIN_TRY(get_number(*found, "scale", name, &file.depth_scale));
    BURIN_TRY(check_positive(file.depth_scale, name.c_str(), "scale"));
    return finish(file, name);
}

Result<CameraFile> parse_open3d_intrinsic_json(std::string_view text, const std::string& name) {
    Result<json> root = parse_json(text, name);
    if (!root) return root.status();
    CameraFile file;
    BURIN_TRY(get_size(*root, "width", "height", name, &file.depth));
    const auto matrix = root->find("intrinsic_matrix");
    if (matrix == root->end() || !matrix->is_array() || matrix->size() != 9)
        return Status::error(Code::format,
                             "%s: no 'intrinsic_matrix' of 9 numbers, expected one, column by column",
                             name.c_str());
    double m[9];
    for (std::size_t i = 0; i < 9; ++i) {
        if (!(*matrix)[i].is_number())
            return Status::error(Code::format, "%s: intrinsic_matrix entry %zu is no number, expected 9",
                                 name.c_str(), i);
        m[i] = (*matrix)[i].get<double>();
    }
    if (m[1] != 0 || m[2] != 0 || m[3] != 0 || m[5] != 0 || m[8] != 1)
        return Status::error(Code::format,
                             "%s: intrinsic_matrix is no pinhole camera, expected fx 0 0, 0 fy 0, cx cy 1",
                             name.c_str());
    file.depth.fx = m[0], file.depth.fy = m[4], file.depth.cx = m[6], file.depth.cy = m[7];
    if (const auto scale = root->find("depth_scale"); scale != root->end()) {
        BURIN_TRY(get_number(*root, "depth_scale", name, &file.depth_scale));
        BURIN_TRY(check_positive(file.depth_scale, name.c_str(), "depth_scale"));
    }
    return finish(file, name);
}

Result<CameraFile> read_camera_text(const std::string& path, bool allow_flipped_fy) {
    return read_with<bool>(parse_camera_text, path, allow_flipped_fy);
}
Result<CameraFile> read_intrinsic_matrix(const std::string& path) {
    return read_with(parse_intrinsic_matrix, path);
}
Result<CameraFile> read_cam_params_json(const std::string& path) {
    return read_with(parse_cam_params_json, path);
}
Result<CameraFile> read_open3d_intrinsic_json(const std::string& path) {
    return read_with(parse_open3d_intrinsic_json, path);
}

}  // namespace burin
