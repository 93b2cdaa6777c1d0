// SPDX-License-Identifier: MIT
// The global planes: each the sum of the patches that chunks hold of it, with an id that lasts.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/arena.h"
#include "planes/candidates.h"
#include "planes/plane.h"

namespace burin {

enum class PlaneChange : std::uint8_t { added, changed, merged, removed };
struct PlaneEvent {
    PlaneChange what;
    std::uint32_t id;
    std::uint32_t into = 0;  // merged: the id of the plane that took it in
};

struct GlobalPlane {
    std::uint32_t id = 0;       // 1, 2, ... in order of appearance; 0: the place is free
    std::uint32_t patches = 0;  // chunks that hold some of it
    Scatter sums;
    double area_m2 = 0;       // about; as patches come and go
    double seen_area_m2 = 0;  // by its extent, as of the last refresh
    // The equation in use. It follows the fit in steps, so that surfaces do not tremble.
    Vec3d normal;
    double offset = 0;
    PlaneFit fit;        // of the sums as they are
    Vec3d low, high;     // a box around its patches; grows only, until planes merge
    bool stale = false;  // sums have changed since the fit
    std::uint8_t label = 0;
    double distance(Vec3d x) const { return dot(normal, x) + offset; }
    // Weighted rms distance of its patches, metres.
    double rms_m() const;
    // 4x4, row-major, of (normal, offset): from the scatter, each patch counted as one measurement.
    void covariance(double out[16]) const;
};

// Smaller planes are not told, and hold up nothing.
inline constexpr double kLeastPlaneM2 = 0.1;

struct PlaneRules {
    double voxel_m = 0.005;
    // A patch belongs to a plane when its normal is within 12 degrees (a chunk of 8 voxels holds a normal to
    // some 3 degrees at a noise of half a voxel) and its middle within half a voxel and three standard
    // deviations, but never more than two voxels: a door's panel 12 mm from its frame is another plane.
    double least_cosine = 0.978;
    double gate(const Patch& patch) const {
        return std::min(2 * voxel_m, 0.5 * voxel_m + 3 * static_cast<double>(patch.rms_m));
    }
    double margin_m = 0.25;  // and lies within the plane's box and so much more
    // Metres that a used equation may lag behind the fit anywhere on the plane, in voxels.
    double lag_voxels = 0.04;
};

class PlaneSet {
  public:
    void place(Arena& arena, std::uint32_t planes, std::uint32_t events);
    void clear();
    PlaneRules rules;

    std::uint32_t used() const { return used_; }  // places 0..used()-1 may hold planes
    GlobalPlane& at(std::uint32_t i) { return planes_[i]; }
    const GlobalPlane& at(std::uint32_t i) const { return planes_[i]; }
    // Counts the steps of all planes' equations in use.
    std::uint32_t revision() const { return revision_; }

    // The plane that the patch fits best, kNoPlane for none. centre: of its chunk.
    std::uint16_t match(const Patch& patch, Vec3d centre) const;
    bool fits(const GlobalPlane& plane, const Patch& patch, Vec3d centre, double slack) const;
    // A new plane of these sums; kNoPlane when there is no room.
    std::uint16_t create(const Scatter& sums, Vec3d towards);
    void add(std::uint16_t plane, const Patch& patch, Vec3d centre);
    void take(std::uint16_t plane, const Patch& patch, Vec3d centre);
    // New fits where sums have changed; planes without patches go.
    void refit();
    // One pair of planes that are one: `from` goes into `into`, whose patches are for the caller to rename.
    // False when there is none.
    bool find_merge(std::uint16_t* into, std::uint16_t* from) const;
    void merge(std::uint16_t into, std::uint16_t from);

    // The events since the last call, oldest first; *lost: how many there was no room for.
    std::uint32_t take_events(PlaneEvent* out, std::uint32_t capacity, std::uint64_t* lost);
    std::uint32_t events() const { return event_count_; }

  private:
    void tell(PlaneEvent event);
    void use(GlobalPlane* plane);

    std::uint32_t capacity_ = 0, used_ = 0, next_id_ = 1, revision_ = 0;
    GlobalPlane* planes_ = nullptr;
    PlaneEvent* events_ = nullptr;
    std::uint32_t event_capacity_ = 0, event_count_ = 0;
    std::uint64_t lost_events_ = 0;
};

// The area of a patch: its columns as they lie on the plane.
double patch_area(const Patch& patch, double voxel_m);

}  // namespace burin
