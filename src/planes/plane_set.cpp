// SPDX-License-Identifier: MIT
#include "planes/plane_set.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace burin {
namespace {

Vec3d least(Vec3d a, Vec3d b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
Vec3d most(Vec3d a, Vec3d b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }

bool within(Vec3d x, Vec3d low, Vec3d high, double margin) {
    for (int r = 0; r < 3; ++r)
        if (!(x[r] >= low[r] - margin && x[r] <= high[r] + margin)) return false;
    return true;
}

}  // namespace

double patch_area(const Patch& patch, double voxel_m) {
    const double along = std::fabs(static_cast<double>(patch.normal[patch.axis]));
    // 1.2: cells are those within 0.6 voxels of the plane, where 0.5 would be once each.
    return std::popcount(patch.cells) * voxel_m * voxel_m / (1.2 * along);
}

double GlobalPlane::rms_m() const { return std::sqrt(fit.variance[0]); }

// Tilts about the centroid towards the two axes in the plane, and the shift along the normal, are
// independent: variances s^2 / (m lambda_2), s^2 / (m lambda_3) and s^2 / m for m measurements of variance
// s^2.
void GlobalPlane::covariance(double out[16]) const {
    for (int i = 0; i < 16; ++i) out[i] = 0;
    const double m = patches > 0 ? patches : 1, s2 = fit.variance[0];
    const auto add = [&](Vec3d dn, double dd, double variance) {
        const double v[4] = {dn.x, dn.y, dn.z, dd};
        for (int r = 0; r < 4; ++r)
            for (int c = 0; c < 4; ++c) out[4 * r + c] += variance * (v[r] * v[c]);
    };
    add({}, 1, s2 / m);
    for (int k = 1; k < 3; ++k)
        if (fit.variance[k] > 0)
            add(fit.axis[k], -dot(fit.axis[k], fit.centroid), s2 / (m * fit.variance[k]));
}

void PlaneSet::place(Arena& arena, std::uint32_t planes, std::uint32_t events) {
    capacity_ = planes;
    event_capacity_ = events;
    planes_ = arena.allocate<GlobalPlane>(planes, 64);
    events_ = arena.allocate<PlaneEvent>(events, 64);
}

void PlaneSet::clear() {
    used_ = event_count_ = 0;
    next_id_ = 1;
    revision_ = 0;
    lost_events_ = 0;
}

void PlaneSet::tell(PlaneEvent event) {
    // A plane that changes over and over is told once.
    if (event.what == PlaneChange::changed)
        for (std::uint32_t i = event_count_; i-- > 0;)
            if (events_[i].id == event.id && events_[i].what != PlaneChange::merged) return;
    if (event_count_ == event_capacity_) {
        ++lost_events_;
        return;
    }
    events_[event_count_++] = event;
}

std::uint32_t PlaneSet::take_events(PlaneEvent* out, std::uint32_t capacity, std::uint64_t* lost) {
    const std::uint32_t count = std::min(capacity, event_count_);
    std::copy_n(events_, count, out);
    std::copy(events_ + count, events_ + event_count_, events_);
    event_count_ -= count;
    *lost = lost_events_;  // told once
    lost_events_ = 0;
    return count;
}

bool PlaneSet::fits(const GlobalPlane& plane, const Patch& patch, Vec3d centre, double slack) const {
    if (dot(plane.normal, patch.unit_normal()) < 1 - (1 - rules.least_cosine) * slack * slack) return false;
    const Vec3d middle = patch.middle(centre);
    return std::fabs(plane.distance(middle)) <= rules.gate(patch) * slack &&
           within(middle, plane.low, plane.high, rules.margin_m);
}

std::uint16_t PlaneSet::match(const Patch& patch, Vec3d centre) const {
    std::uint16_t best = kNoPlane;
    double nearest = 0;
    const Vec3d middle = patch.middle(centre);
    for (std::uint32_t i = 0; i < used_; ++i) {
        const GlobalPlane& plane = planes_[i];
        if (plane.id == 0 || !fits(plane, patch, centre, 1)) continue;
        const double distance = std::fabs(plane.distance(middle));
        if (best != kNoPlane && !(distance < nearest)) continue;
        best = static_cast<std::uint16_t>(i);
        nearest = distance;
    }
    return best;
}

std::uint16_t PlaneSet::create(const Scatter& sums, Vec3d towards) {
    std::uint32_t i = 0;
    while (i < used_ && planes_[i].id != 0) ++i;
    if (i == capacity_) return kNoPlane;
    used_ = std::max(used_, i + 1);
    GlobalPlane& plane = planes_[i] = {};
    plane.id = next_id_++;
    plane.fit = fit_plane(sums, towards);
    plane.low = plane.high = plane.fit.centroid;
    use(&plane);
    tell({PlaneChange::added, plane.id});
    return static_cast<std::uint16_t>(i);
}

void PlaneSet::use(GlobalPlane* plane) {
    plane->normal = plane->fit.normal;
    plane->offset = plane->fit.offset;
    ++revision_;
}

void PlaneSet::add(std::uint16_t i, const Patch& patch, Vec3d centre) {
    GlobalPlane& plane = planes_[i];
    plane.sums.add(patch.scatter(centre));
    plane.area_m2 += patch_area(patch, rules.voxel_m);
    ++plane.patches;
    const double half = 0.5 * kChunkSide * rules.voxel_m;
    plane.low = least(plane.low, centre - Vec3d{half, half, half});
    plane.high = most(plane.high, centre + Vec3d{half, half, half});
    plane.stale = true;
}

void PlaneSet::take(std::uint16_t i, const Patch& patch, Vec3d centre) {
    GlobalPlane& plane = planes_[i];
    plane.sums.add(patch.scatter(centre), -1);
    plane.area_m2 -= patch_area(patch, rules.voxel_m);
    --plane.patches;
    plane.stale = true;
}

void PlaneSet::refit() {
    for (std::uint32_t i = 0; i < used_; ++i) {
        GlobalPlane& plane = planes_[i];
        if (plane.id == 0 || !plane.stale) continue;
        plane.stale = false;
        if (plane.patches == 0 || !(plane.sums.n > 0)) {
            tell({PlaneChange::removed, plane.id});
            plane.id = 0;
            ++revision_;
            continue;
        }
        plane.fit = fit_plane(plane.sums, plane.normal);
        // The farthest that the two differ over the box: at one of its corners.
        const Vec3d tilt = plane.fit.normal - plane.normal;
        const Vec3d middle = (plane.low + plane.high) * 0.5, half = (plane.high - plane.low) * 0.5;
        double apart = std::fabs(dot(tilt, middle) + plane.fit.offset - plane.offset);
        for (int r = 0; r < 3; ++r) apart += std::fabs(tilt[r]) * half[r];
        if (apart <= rules.lag_voxels * rules.voxel_m) continue;
        use(&plane);
        tell({PlaneChange::changed, plane.id});
    }
}

bool PlaneSet::find_merge(std::uint16_t* into, std::uint16_t* from) const {
    for (std::uint32_t i = 0; i < used_; ++i)
        for (std::uint32_t j = i + 1; j < used_; ++j) {
            const GlobalPlane &a = planes_[i], &b = planes_[j];
            if (a.id == 0 || b.id == 0 || dot(a.normal, b.normal) < rules.least_cosine) continue;
            // What hides a part of a wall is no larger than the wall: large planes are one across wider gaps.
            const double smaller = std::max(0.0, std::min(a.area_m2, b.area_m2));
            const double gap = rules.margin_m + std::min(2.0, 0.5 * std::sqrt(smaller));
            bool apart = false;
            for (int r = 0; r < 3; ++r) apart |= a.low[r] > b.high[r] + gap || b.low[r] > a.high[r] + gap;
            if (apart) continue;
            Scatter sums = a.sums;
            sums.add(b.sums);
            const PlaneFit both = fit_plane(sums, a.normal);
            // As one plane they are hardly worse than as two, and each lies in it.
            const double two = (a.fit.variance[0] * a.sums.n + b.fit.variance[0] * b.sums.n) / sums.n;
            const double step = 0.25 * rules.voxel_m, gate = 0.8 * rules.voxel_m;
            const auto off = [&](const GlobalPlane& p) {
                return std::fabs(dot(both.normal, p.fit.centroid) + both.offset);
            };
            if (both.variance[0] > 1.2 * two + step * step || off(a) > gate || off(b) > gate) continue;
            if (dot(both.normal, a.normal) < rules.least_cosine ||
                dot(both.normal, b.normal) < rules.least_cosine)
                continue;
            const bool first = a.id < b.id;
            *into = static_cast<std::uint16_t>(first ? i : j);
            *from = static_cast<std::uint16_t>(first ? j : i);
            return true;
        }
    return false;
}

void PlaneSet::merge(std::uint16_t into, std::uint16_t from) {
    GlobalPlane &a = planes_[into], &b = planes_[from];
    a.sums.add(b.sums);
    a.area_m2 += b.area_m2;
    a.patches += b.patches;
    a.low = least(a.low, b.low);
    a.high = most(a.high, b.high);
    a.stale = true;
    tell({PlaneChange::merged, b.id, a.id});
    b.id = 0;
    ++revision_;
}

}  // namespace burin
