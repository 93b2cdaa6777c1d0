// SPDX-License-Identifier: MIT
// planes.json, found or true.
#include <cerrno>
#include <cmath>
#include <cstring>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "eval/plane_metrics.h"

namespace burin {
namespace {

using Json = nlohmann::json;

Status wrong(const char* name, std::size_t entry, const char* key, const char* expected) {
    return Status::error(Code::format, "%s: plane %zu, \"%s\": expected %s", name, entry, key, expected);
}

bool number(const Json& entry, const char* key, double* out) {
    if (!entry.contains(key) || !entry[key].is_number()) return false;
    *out = entry[key].get<double>();
    return std::isfinite(*out);
}

bool point(const Json& list, Vec3d* out) {
    if (!list.is_array() || list.size() != 3) return false;
    for (int i = 0; i < 3; ++i) {
        const Json& value = list[static_cast<std::size_t>(i)];
        if (!value.is_number() || !std::isfinite(value.get<double>())) return false;
        (*out)[i] = value.get<double>();
    }
    return true;
}

bool ring(const Json& list, Ring* out) {
    if (!list.is_array()) return false;
    for (const Json& item : list) {
        Vec3d p;
        if (!point(item, &p)) return false;
        out->push_back(p);
    }
    return true;
}

bool label(const Json& entry, std::uint8_t* out) {
    if (!entry.contains("label")) return false;
    if (entry["label"].is_number_unsigned() && entry["label"].get<unsigned>() < 8) {
        *out = static_cast<std::uint8_t>(entry["label"].get<unsigned>());
        return true;
    }
    if (!entry["label"].is_string()) return false;
    for (std::uint8_t i = 0; i < 8; ++i)
        if (entry["label"] == label_name(i)) {
            *out = i;
            return true;
        }
    return false;
}

Status read_plane(const Json& entry, const char* name, std::size_t index, LabelledPlane* plane) {
    if (!entry.is_object()) return wrong(name, index, "", "an object");
    double id = 0;
    if (!number(entry, "id", &id)) return wrong(name, index, "id", "a number");
    plane->id = static_cast<int>(id);
    if (!label(entry, &plane->label)) return wrong(name, index, "label", "a name or 0..7");
    if (!entry.contains("normal") || !point(entry["normal"], &plane->normal) ||
        std::fabs(norm(plane->normal) - 1) > 1e-3)  // more than single precision would lose
        return wrong(name, index, "normal", "3 numbers, unit length");
    if (!number(entry, "offset", &plane->offset)) return wrong(name, index, "offset", "a number");
    plane->offset /= norm(plane->normal);
    plane->normal = normalised(plane->normal);
    if (!number(entry, "area_m2", &plane->area_m2)) return wrong(name, index, "area_m2", "a number");
    if (entry.contains("seen_area_m2") && !number(entry, "seen_area_m2", &plane->seen_area_m2))
        return wrong(name, index, "seen_area_m2", "a number");
    if (entry.contains("rings")) {
        if (!entry["rings"].is_array()) return wrong(name, index, "rings", "a list of lists of points");
        for (const Json& item : entry["rings"]) {
            plane->rings.emplace_back();
            if (!ring(item, &plane->rings.back()))
                return wrong(name, index, "rings", "a list of lists of points of 3 numbers");
        }
    } else {
        plane->rings.emplace_back();
        if (!entry.contains("polygon") || !ring(entry["polygon"], &plane->rings.back()))
            return wrong(name, index, "polygon", "a list of points of 3 numbers");
    }
    return {};
}

}  // namespace

Result<std::vector<LabelledPlane>> parse_planes(const std::string& text, const char* name) try {
    const Json json = Json::parse(text, nullptr, false);
    if (!json.is_array()) return Status::error(Code::format, "%s: expected a JSON list of planes", name);
    std::vector<LabelledPlane> planes(json.size());
    for (std::size_t i = 0; i < planes.size(); ++i) BURIN_TRY(read_plane(json[i], name, i, &planes[i]));
    return planes;
} catch (const std::exception& e) {
    return Status::error(Code::format, "%s: %s", name, e.what());
}

Result<std::vector<LabelledPlane>> read_planes(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) return Status::error(Code::io, "cannot open '%s': %s", path.c_str(), std::strerror(errno));
    std::ostringstream text;
    text << file.rdbuf();
    if (file.bad()) return Status::error(Code::io, "cannot read '%s'", path.c_str());
    return parse_planes(text.str(), path.c_str());
}

}  // namespace burin
