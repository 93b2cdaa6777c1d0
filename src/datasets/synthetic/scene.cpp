// SPDX-License-Identifier: MIT
#include "datasets/synthetic/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace burin {

using synthetic::Part;
using synthetic::Shape;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Polynomial smooth minimum and how much of b it takes (0 all a, 1 all b).
double smooth_min(double a, double b, double k, double* share_b) {
    const double h = std::clamp(0.5 + 0.5 * (a - b) / k, 0.0, 1.0);
    *share_b = h;
    const double s = std::max(k - std::fabs(a - b), 0.0) / k;
    return std::min(a, b) - s * s * k * 0.25;
}

double distance_to(const Part& part, Vec3d p) { return synthetic::part_distance(part, part.to_part(p)); }

}  // namespace

Result<std::unique_ptr<SyntheticScene>> SyntheticScene::create(synthetic::SceneData data) {
    if (data.parts.empty() || data.parts.size() > 65535)
        return Status::error(Code::invalid_argument, "scene %s: %zu parts, expected 1 to 65535",
                             data.name.c_str(), data.parts.size());
    // Parts of one blend must stand together in every list.
    std::stable_sort(data.parts.begin(), data.parts.end(),
                     [](const Part& a, const Part& b) { return a.blend < b.blend; });
    // The grid reaches past the truth mesh: beyond it every distance looks at every part.
    constexpr double kMargin = 0.05;
    for (int axis = 0; axis < 3; ++axis) {
        data.bounds.low[axis] = std::min(data.bounds.low[axis], data.mesh_bounds.low[axis] - kMargin);
        data.bounds.high[axis] = std::max(data.bounds.high[axis], data.mesh_bounds.high[axis] + kMargin);
    }
    std::unique_ptr<SyntheticScene> scene(new SyntheticScene(std::move(data)));
    scene->build_grid();
    return scene;
}

void SyntheticScene::build_grid() {
    const auto& parts = data_.parts;
    const Vec3d extent = data_.bounds.high - data_.bounds.low;
    for (int axis = 0; axis < 3; ++axis)
        size_[axis] = std::max(1, static_cast<int>(std::ceil(extent[axis] / data_.cell)));
    const double radius = 0.5 * std::sqrt(3.0) * data_.cell;
    all_.resize(parts.size());
    std::iota(all_.begin(), all_.end(), std::uint16_t(0));
    for (std::uint16_t i : all_)
        if (parts[i].shape == Shape::half_space) half_spaces_.push_back(i);

    // The parts that can decide the distance somewhere in a ball: all part distances change by at most its
    // radius. A blend's value lies at most k below its nearest part, and a part changes it only while within
    // k of the value so far: 3 k above the nearest is out of reach also where the blend's surface touches
    // another solid.
    std::vector<double> d(parts.size());
    const auto select = [&](const Items& from, Vec3d centre, double r, Items* out) {
        double best = kInfinity;
        for (std::uint16_t i : from) best = std::min(best, d[i] = distance_to(parts[i], centre));
        double limit = best + 2 * r;
        for (std::uint16_t i : from) {
            const double slack =
                parts[i].blend >= 0 ? 3 * data_.blends[static_cast<std::size_t>(parts[i].blend)].k : 0;
            if (d[i] <= limit + slack) out->push_back(i);
        }
    };
    // Blocks of 4^3 cells first, so that a cell looks only at what its block kept.
    const std::size_t cells = static_cast<std::size_t>(size_[0]) * size_[1] * size_[2];
    constexpr int kBlock = 4;
    std::vector<Items> near_of(cells), crossing_of(cells);
    Items in_block, group;
    for (int bz = 0; bz < size_[2]; bz += kBlock)
        for (int by = 0; by < size_[1]; by += kBlock)
            for (int bx = 0; bx < size_[0]; bx += kBlock) {
                const Vec3d block_centre =
                    data_.bounds.low +
                    Vec3d{bx + 0.5 * kBlock, by + 0.5 * kBlock, bz + 0.5 * kBlock} * data_.cell;
                in_block.clear();
                select(all_, block_centre, kBlock * radius, &in_block);
                for (int z = bz; z < std::min(bz + kBlock, size_[2]); ++z)
                    for (int y = by; y < std::min(by + kBlock, size_[1]); ++y)
                        for (int x = bx; x < std::min(bx + kBlock, size_[0]); ++x) {
                            const std::size_t cell =
                                (static_cast<std::size_t>(z) * size_[1] + y) * size_[0] + x;
                            const Vec3d centre =
                                data_.bounds.low + Vec3d{x + 0.5, y + 0.5, z + 0.5} * data_.cell;
                            select(in_block, centre, radius, &near_of[cell]);
                            const Items& near = near_of[cell];
                            for (std::size_t i = 0; i < near.size();) {
                                std::size_t j = i + 1;
                                const std::int16_t blend = parts[near[i]].blend;
                                while (blend >= 0 && j < near.size() && parts[near[j]].blend == blend) ++j;
                                const double value = fold({near.data() + i, near.data() + j}, centre);
                                // A margin of a nanometre covers rounding at cell borders.
                                if (parts[near[i]].shape != Shape::half_space &&
                                    std::fabs(value) <= radius + 1e-9)
                                    crossing_of[cell].insert(crossing_of[cell].end(),
                                                             near.begin() + static_cast<std::ptrdiff_t>(i),
                                                             near.begin() + static_cast<std::ptrdiff_t>(j));
                                i = j;
                            }
                        }
            }
    const auto pack = [](const std::vector<Items>& lists, std::vector<std::uint32_t>* begin, Items* items) {
        for (const Items& list : lists) {
            begin->push_back(static_cast<std::uint32_t>(items->size()));
            items->insert(items->end(), list.begin(), list.end());
        }
        begin->push_back(static_cast<std::uint32_t>(items->size()));
    };
    pack(near_of, &near_begin_, &near_);
    pack(crossing_of, &crossing_begin_, &crossing_);
}

SyntheticScene::Range SyntheticScene::near_items(Vec3d p) const {
    int c[3];
    for (int axis = 0; axis < 3; ++axis) {
        const double x = std::floor((p[axis] - data_.bounds.low[axis]) / data_.cell);
        if (!(x >= 0 && x < size_[axis])) return {all_.data(), all_.data() + all_.size()};
        c[axis] = static_cast<int>(x);
    }
    const std::size_t cell = (static_cast<std::size_t>(c[2]) * size_[1] + c[1]) * size_[0] + c[0];
    return {near_.data() + near_begin_[cell], near_.data() + near_begin_[cell + 1]};
}

double SyntheticScene::fold(Range items, Vec3d p) const {
    double best = kInfinity;
    for (const std::uint16_t* i = items.begin; i != items.end;) {
        const Part& part = data_.parts[*i];
        double d = distance_to(part, p);
        if (part.blend < 0) {
            ++i;
        } else {
            const double k = data_.blends[static_cast<std::size_t>(part.blend)].k;
            double share = 0;
            for (++i; i != items.end && data_.parts[*i].blend == part.blend; ++i)
                d = smooth_min(d, distance_to(data_.parts[*i], p), k, &share);
        }
        best = std::min(best, d);
    }
    return best;
}

SyntheticScene::Nearest SyntheticScene::nearest(Range items, Vec3d p) const {
    Nearest best{kInfinity, -1, {0, 0, 1}};
    for (const std::uint16_t* i = items.begin; i != items.end;) {
        const std::int16_t blend = data_.parts[*i].blend;
        Nearest group{kInfinity, -1, {}};
        double nearest_part = kInfinity;
        do {
            const Part& part = data_.parts[*i];
            Vec3d g;
            const double d = synthetic::part_distance(part, part.to_part(p), &g);
            g = part.to_scene_direction(g);
            if (group.part < 0) {
                group = {d, *i, g};
                nearest_part = d;
            } else {
                double share = 0;
                const double folded =
                    smooth_min(group.distance, d, data_.blends[static_cast<std::size_t>(blend)].k, &share);
                group.gradient = group.gradient * (1 - share) + g * share;
                group.distance = folded;
                if (d < nearest_part) nearest_part = d, group.part = *i;
            }
            ++i;
        } while (blend >= 0 && i != items.end && data_.parts[*i].blend == blend);
        if (group.distance < best.distance) best = group;
    }
    return best;
}

SyntheticScene::Nearest SyntheticScene::nearest(Vec3d p) const { return nearest(near_items(p), p); }

double SyntheticScene::distance(Vec3d p) const { return fold(near_items(p), p); }

Vec3d SyntheticScene::normal(Vec3d p) const { return normalised(nearest(p).gradient); }

// The foot of the perpendicular from p on the surface of one blend or relief: first down the gradient to the
// surface, then along it by the tangential part of p - q, and again. Each round shrinks the angle between p -
// q and the normal.
Vec3d SyntheticScene::foot_point(Range group, Vec3d p) const {
    Vec3d q = p;
    constexpr int kRounds = 16;
    for (int round = 0; round < kRounds; ++round) {
        Nearest here = nearest(group, q);
        for (int newton = 0; newton < 20 && std::fabs(here.distance) > 1e-10; ++newton) {
            q = q - here.gradient * (here.distance / std::max(dot(here.gradient, here.gradient), 0.05));
            here = nearest(group, q);
        }
        const Vec3d n = normalised(here.gradient), gap = p - q;
        const Vec3d slide = gap - n * dot(gap, n);
        if (norm(slide) < 1e-9 || round + 1 == kRounds) break;
        q = q + slide * 0.7;  // damped: on a surface curved towards p a full step overshoots
    }
    return q;
}

double SyntheticScene::surface_distance(Vec3d p, Vec3d* nearest_point) const {
    // Outside, the distance of a union is the least of its members', each of them Euclidean; inside, the
    // member that p lies deepest in decides. So first the exact parts, then whatever else might still be
    // nearer.
    const Range items = near_items(p);
    const bool inside = fold(items, p) < 0;
    double best = kInfinity, best_bound = kInfinity;
    Vec3d foot = p;
    for (const bool exact_pass : {true, false})
        for (const std::uint16_t* i = items.begin; i != items.end;) {
            const std::uint16_t* j = i + 1;
            while (part(*i).blend >= 0 && j != items.end && part(*j).blend == part(*i).blend) ++j;
            const Range group{i, j};
            const bool exact = part(*i).blend < 0 && part(*i).shape != Shape::relief;
            i = j;
            if (exact != exact_pass) continue;
            const Nearest here = nearest(group, p);
            if (inside ? here.distance >= best_bound : here.distance >= best) continue;
            best_bound = here.distance;
            const Vec3d q = exact ? p - here.gradient * here.distance : foot_point(group, p);
            const double d = exact ? here.distance : (here.distance < 0 ? -norm(p - q) : norm(p - q));
            if (inside || d < best) best = d, foot = q;
        }
    if (nearest_point) *nearest_point = foot;
    return best;
}

std::uint8_t SyntheticScene::label(Vec3d p) const { return part(nearest(p).part).label; }
int SyntheticScene::instance(Vec3d p) const { return part(nearest(p).part).instance; }

Vec3f SyntheticScene::albedo(Vec3d p) const {
    const Nearest here = nearest(p);
    return albedo_at(p, normalised(here.gradient), here.part, 0);
}

Vec3f SyntheticScene::albedo_at(Vec3d p, Vec3d n, int index, double footprint) const {
    const Part& hit = part(index);
    return synthetic::albedo_of(data_.materials[hit.material], hit.to_part(p), hit.R_part_scene * n,
                                footprint);
}

Vec3d SyntheticScene::normal_at(Vec3d p, int index) const {
    const Part& hit = part(index);
    if (hit.blend >= 0) return normalised(nearest(p).gradient);
    Vec3d g;
    synthetic::part_distance(hit, hit.to_part(p), &g);
    return normalised(hit.to_scene_direction(g));
}

}  // namespace burin
