// SPDX-License-Identifier: MIT
#include "eval/plane_objects.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <exception>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>
#include <sstream>

#include "datasets/synthetic/render.h"

namespace burin {
namespace {

using synthetic::Part;

constexpr std::uint8_t kSeat = 5;  // of the labels none wall floor ceiling table seat window door

bool is_thing(const Part& part) { return part.label == 0 || part.label == kSeat; }

// What was seen of a part.
struct Seen {
    Vec3d low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
    int pixels = 0;
    std::vector<Vec3d> points;  // some of them

    void add(Vec3d p) {
        for (int k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], p[k]);
            high[k] = std::max(high[k], p[k]);
        }
        // Every so many: where the search for a contact starts from.
        constexpr int kEvery = 64, kMost = 32;
        if (pixels++ % kEvery == 0 && points.size() < kMost) points.push_back(p);
    }
    void add(const Seen& other) {
        for (int k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], other.low[k]);
            high[k] = std::max(high[k], other.high[k]);
        }
        pixels += other.pixels;
    }
};

// Moves a point onto the solid when it is outside; returns how far it was.
double pull(const Part& part, Vec3d* p) {
    Vec3d gradient;
    const double d = part_distance(part, part.to_part(*p), &gradient);
    if (d > 0) *p = *p - part.to_scene_direction(gradient) * d;
    return d;
}

// Whether two solids come closer than a gap: alternating projections, which find it between convex ones, and
// from many starts between others too.
bool touch(const Part& a, const Part& b, std::vector<Vec3d> starts, double gap) {
    starts.push_back(a.position);
    starts.push_back(b.position);
    for (Vec3d p : starts)
        for (int step = 0; step < 30; ++step) {
            pull(a, &p);
            const double d = pull(b, &p);
            if (d <= gap) return true;
        }
    return false;
}

// A sheet on a table or a wall: as far as depth can tell, it is that.
bool is_sheet(const Part& part, const std::vector<Part>& parts, const TrueObjectOptions& options) {
    if (part.shape != synthetic::Shape::box ||
        2 * std::min({part.size.x, part.size.y, part.size.z}) >= options.min_thickness_m)
        return false;
    return std::any_of(parts.begin(), parts.end(), [&](const Part& other) {
        return !is_thing(other) && touch(part, other, {}, options.max_gap_m);
    });
}

int root_of(std::vector<int>& parent, int i) {
    while (parent[static_cast<std::size_t>(i)] != i) i = parent[static_cast<std::size_t>(i)];
    return i;
}

Camera at_width(const Camera& camera, int width) {
    Camera out = camera;
    const double s = static_cast<double>(width) / camera.width;
    out.width = width;
    out.height = std::max(1, static_cast<int>(camera.height * s));
    out.fx *= s;
    out.fy *= s;
    out.cx = (out.cx + 0.5) * s - 0.5;  // pixel centres at whole numbers
    out.cy = (out.cy + 0.5) * s - 0.5;
    return out;
}

bool vector_of(const nlohmann::json& entry, const char* key, Vec3d* out) {
    if (!entry.contains(key) || !entry[key].is_array() || entry[key].size() != 3) return false;
    for (int k = 0; k < 3; ++k) {
        const auto& value = entry[key][static_cast<std::size_t>(k)];
        if (!value.is_number() || !std::isfinite(value.get<double>())) return false;
        (*out)[k] = value.get<double>();
    }
    return true;
}

}  // namespace

Result<std::vector<ObjectBounds>> parse_objects(const std::string& text, const char* name) try {
    const auto json = nlohmann::json::parse(text, nullptr, false);
    if (!json.is_array()) return Status::error(Code::format, "%s: expected a JSON list of objects", name);
    std::vector<ObjectBounds> out(json.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
        const auto& entry = json[i];
        if (!entry.is_object() || !entry.contains("id") || !entry["id"].is_number_integer() ||
            !vector_of(entry, "min", &out[i].low) || !vector_of(entry, "max", &out[i].high))
            return Status::error(Code::format,
                                 "%s: object %zu: expected \"id\", \"min\" and \"max\" (3 numbers)", name, i);
        out[i].id = entry["id"].get<int>();
    }
    return out;
} catch (const std::exception& e) {
    return Status::error(Code::format, "%s: %s", name, e.what());
}

Result<std::vector<ObjectBounds>> read_objects(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) return Status::error(Code::io, "cannot open '%s': %s", path.c_str(), std::strerror(errno));
    std::ostringstream text;
    text << file.rdbuf();
    return parse_objects(text.str(), path.c_str());
}

double box_iou(const ObjectBounds& a, const ObjectBounds& b) {
    double both = 1, first = 1, second = 1;
    for (int k = 0; k < 3; ++k) {
        both *= std::max(0.0, std::min(a.high[k], b.high[k]) - std::max(a.low[k], b.low[k]));
        first *= a.high[k] - a.low[k];
        second *= b.high[k] - b.low[k];
    }
    const double all = first + second - both;
    return all > 0 ? both / all : 0;
}

ObjectMatches match_objects(const std::vector<ObjectBounds>& found, const std::vector<ObjectBounds>& truth,
                            double min_iou) {
    std::vector<ObjectMatches::Pair> all;
    for (int t = 0; t < static_cast<int>(truth.size()); ++t)
        for (int f = 0; f < static_cast<int>(found.size()); ++f)
            if (const double iou =
                    box_iou(truth[static_cast<std::size_t>(t)], found[static_cast<std::size_t>(f)]);
                iou > 0)
                all.push_back({t, f, iou});
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.iou > b.iou; });
    ObjectMatches out;
    std::vector<std::uint8_t> true_taken(truth.size(), 0), found_taken(found.size(), 0);
    for (const auto& pair : all) {
        auto &t = true_taken[static_cast<std::size_t>(pair.truth)],
             &f = found_taken[static_cast<std::size_t>(pair.found)];
        if (pair.iou < min_iou || t || f) continue;
        t = f = 1;
        out.pairs.push_back(pair);
    }
    const auto best = [&](auto mine, ObjectMatches::Pair none) {
        const auto it = std::find_if(all.begin(), all.end(), mine);
        return it == all.end() ? none : *it;
    };
    for (int t = 0; t < static_cast<int>(truth.size()); ++t)
        if (!true_taken[static_cast<std::size_t>(t)])
            out.missed.push_back(best([t](const auto& p) { return p.truth == t; }, {t, -1, 0}));
    for (int f = 0; f < static_cast<int>(found.size()); ++f)
        if (!found_taken[static_cast<std::size_t>(f)])
            out.invented.push_back(best([f](const auto& p) { return p.found == f; }, {-1, f, 0}));
    const double matched = static_cast<double>(out.pairs.size());
    if (!truth.empty()) out.recall = matched / static_cast<double>(truth.size());
    if (!found.empty()) out.precision = matched / static_cast<double>(found.size());
    return out;
}

Result<std::vector<ObjectBounds>> true_objects(const SyntheticScene& scene, const Camera& camera,
                                               const Trajectory& poses, const TrueObjectOptions& options,
                                               Jobs& jobs) {
    const std::vector<Part>& parts = scene.data().parts;
    std::vector<Seen> seen(parts.size());
    const Camera small = at_width(camera, std::min(options.width, camera.width));
    const std::size_t frames = std::min(poses.size(), static_cast<std::size_t>(options.frames));
    TruthImages images;
    for (std::size_t k = 0; k < frames; ++k) {
        const Se3& T_scene_camera = poses[poses.size() * k / frames].T_world_camera;
        BURIN_TRY(render_truth(scene, small, T_scene_camera, true, jobs, &images));
        for (int y = 0; y < small.height; ++y)
            for (int x = 0; x < small.width; ++x) {
                const double z = images.depth_m.view().at(x, y);
                const int part = images.part.view().at(x, y);
                if (part < 0 || !(z > 0 && z <= options.max_depth_m)) continue;
                const Vec3d ray = unproject(small, {static_cast<double>(x), static_cast<double>(y)});
                seen[static_cast<std::size_t>(part)].add(T_scene_camera * (ray * z));
            }
    }
    // Things that touch are one. Only parts that were seen join others, and only those whose seen boxes are
    // closer than any part is large: what is out of sight cannot be told.
    std::vector<int> things, parent(parts.size());
    std::iota(parent.begin(), parent.end(), 0);
    for (int i = 0; i < static_cast<int>(parts.size()); ++i)
        if (const Part& part = parts[static_cast<std::size_t>(i)];
            is_thing(part) && seen[static_cast<std::size_t>(i)].pixels > 0 && !is_sheet(part, parts, options))
            things.push_back(i);
    for (std::size_t i = 0; i < things.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            const int a = root_of(parent, things[i]), b = root_of(parent, things[j]);
            if (a == b) continue;
            const Seen &s = seen[static_cast<std::size_t>(things[i])],
                       &t = seen[static_cast<std::size_t>(things[j])];
            constexpr double kReach =
                0.1;  // metres from the seen part of a solid to where it touches another
            bool near = true;
            for (int k = 0; k < 3; ++k)
                near = near && s.low[k] < t.high[k] + kReach && t.low[k] < s.high[k] + kReach;
            if (!near) continue;
            std::vector<Vec3d> starts = s.points;
            starts.insert(starts.end(), t.points.begin(), t.points.end());
            if (touch(parts[static_cast<std::size_t>(things[i])], parts[static_cast<std::size_t>(things[j])],
                      std::move(starts), options.max_gap_m))
                parent[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
        }
    std::map<int, Seen> joined;
    std::map<int, std::set<int>> instances;
    for (const int i : things) {
        const int root = root_of(parent, i);
        joined[root].add(seen[static_cast<std::size_t>(i)]);
        instances[root].insert(parts[static_cast<std::size_t>(i)].instance);
    }
    std::vector<ObjectBounds> out;
    for (const auto& [root, box] : joined) {
        const Vec3d size = box.high - box.low;
        if (box.pixels < options.min_pixels || std::max({size.x, size.y, size.z}) < options.min_size_m ||
            std::min({size.x, size.y, size.z}) < options.min_thickness_m)
            continue;
        out.push_back({static_cast<int>(out.size()), box.low, box.high, ""});
        std::string& name = out.back().name;
        for (const int instance : instances[root]) {
            if (!name.empty()) name += '+';
            name += std::to_string(instance);
        }
    }
    return out;
}

}  // namespace burin
