// SPDX-License-Identifier: MIT
// Step two of Dzitsiuk et al. (ICRA 2017): new global planes from the patches that belong to none.
#include <algorithm>
#include <cmath>

#include "core/hash.h"
#include "planes/plane_layer.h"

namespace burin {
namespace {

constexpr std::uint32_t kLeastPatches = 8;  // 2 x 4 chunks
constexpr double kLeastArea = 0.012;        // m^2: 8 chunks of 40 mm
// Patches of a region that grows; places of planes are fewer.
constexpr std::uint16_t kQueued = 0xfffe;

}  // namespace

std::uint32_t PlaneLayer::list_unassigned() {
    std::uint32_t count = 0;
    for (std::uint32_t entry = 0; entry < overlay_.count(); ++entry)
        for (std::uint32_t i = 0; i < chunks_[entry].count; ++i)
            if (chunks_[entry].patch[i].plane == kNoPlane && count < options_.chunks)
                unassigned_[count++] = 4 * entry + i;
    return count;
}

std::uint32_t PlaneLayer::choose_members(const PlaneFit& fit, Vec3d low, Vec3d high, double margin,
                                         Scatter* sums, double* area, Vec3d* grown_low, Vec3d* grown_high) {
    std::uint32_t count = 0;
    *sums = {};
    *area = 0;
    for (std::uint32_t u = 0; u < unassigned_count_; ++u) {
        const std::uint32_t entry = unassigned_[u] >> 2;
        const Patch& patch = chunks_[entry].patch[unassigned_[u] & 3];
        const Vec3d centre = centre_of(overlay_.key(entry)), middle = patch.middle(centre);
        if (!agrees(fit, patch, middle)) continue;
        bool inside = true;
        for (int r = 0; r < 3; ++r)
            inside = inside && middle[r] >= low[r] - margin && middle[r] <= high[r] + margin;
        if (!inside) continue;
        members_[count++] = unassigned_[u];
        sums->add(patch.scatter(centre));
        *area += patch_area(patch, static_cast<double>(shape_.voxel_m));
        for (int r = 0; r < 3; ++r) {
            (*grown_low)[r] = std::min((*grown_low)[r], middle[r]);
            (*grown_high)[r] = std::max((*grown_high)[r], middle[r]);
        }
    }
    return count;
}

// RANSAC over the candidates: one patch is a hypothesis, and counts those that agree with it within reach of
// its own direction; the best is grown, by new fits to ever more members, as far as they hang together.
int PlaneLayer::seed(int tries) {
    if (options_.merge_by == MergeBy::growing) return seed_region(tries);
    unassigned_count_ = list_unassigned();
    if (unassigned_count_ < kLeastPatches) return 0;
    constexpr double kLocal =
        0.2;  // metres: a patch's direction is sure to 3 degrees, 10 mm at this distance
    constexpr double kMargin = 0.1;  // metres: members of one plane are no farther apart
    Scatter sums, best_sums;
    double area, best_area = 0;
    Vec3d low, high, best_low, best_high, normal;
    for (int t = 0; t < tries; ++t) {
        random_ += 0x9e3779b97f4a7c15ULL;
        const std::uint32_t u = static_cast<std::uint32_t>((mix64(random_) >> 32) * unassigned_count_ >> 32);
        const std::uint32_t entry = unassigned_[u] >> 2;
        const Patch& patch = chunks_[entry].patch[unassigned_[u] & 3];
        PlaneFit fit;
        const Vec3d middle = patch.middle(centre_of(overlay_.key(entry)));
        fit.normal = patch.unit_normal();
        fit.offset = -dot(fit.normal, middle);
        low = high = middle;
        choose_members(fit, middle, middle, kLocal, &sums, &area, &low, &high);
        if (!(area > best_area)) continue;
        best_area = area;
        best_sums = sums;
        best_low = low;
        best_high = high;
        normal = fit.normal;
    }
    if (best_area < kLeastArea) return 0;
    std::uint32_t members = 0;
    // Doubles in extent a round at most; when nothing joins, it is done.
    for (int round = 0; round < 24; ++round) {
        const PlaneFit fit = fit_plane(best_sums, normal);
        normal = fit.normal;
        low = best_low;
        high = best_high;
        const std::uint32_t before = members;
        members = choose_members(fit, best_low, best_high, kMargin, &sums, &area, &low, &high);
        if (members < kLeastPatches) return 0;
        best_sums = sums;
        best_low = low;
        best_high = high;
        best_area = area;
        if (members == before) break;
    }
    if (members < kLeastPatches || best_area < kLeastArea) return 0;
    return found_plane(best_sums, normal, members);
}

int PlaneLayer::found_plane(const Scatter& sums, Vec3d normal, std::uint32_t members) {
    const std::uint16_t plane = set_.create(sums, normal);
    for (std::uint32_t m = 0; m < members; ++m) {
        const std::uint32_t entry = members_[m] >> 2;
        Patch& patch = chunks_[entry].patch[members_[m] & 3];
        patch.plane = plane;
        if (plane != kNoPlane) set_.add(plane, patch, centre_of(overlay_.key(entry)));
    }
    return plane != kNoPlane;
}

// The other strategy: a region that grows from one patch to the neighbours of its members.
int PlaneLayer::seed_region(int tries) {
    unassigned_count_ = list_unassigned();
    if (unassigned_count_ < kLeastPatches) return 0;
    for (int t = 0; t < tries; ++t) {
        random_ += 0x9e3779b97f4a7c15ULL;
        const auto u = static_cast<std::uint32_t>((mix64(random_) >> 32) * unassigned_count_ >> 32);
        PlaneFit fit;
        const std::uint32_t members = grow(unassigned_[u], &fit);
        // What joined early may not lie on the plane that came of it.
        Scatter sums;
        double area = 0;
        std::uint32_t kept = 0;
        for (std::uint32_t m = 0; m < members; ++m) {
            const std::uint32_t entry = members_[m] >> 2;
            Patch& patch = chunks_[entry].patch[members_[m] & 3];
            patch.plane = kNoPlane;
            const Vec3d centre = centre_of(overlay_.key(entry));
            if (!agrees(fit, patch, patch.middle(centre))) continue;
            members_[kept++] = members_[m];
            sums.add(patch.scatter(centre));
            area += patch_area(patch, static_cast<double>(shape_.voxel_m));
        }
        if (kept >= kLeastPatches && area >= kLeastArea) return found_plane(sums, fit.normal, kept);
    }
    return 0;
}

bool PlaneLayer::agrees(const PlaneFit& fit, const Patch& patch, Vec3d middle) const {
    return dot(fit.normal, patch.unit_normal()) >= set_.rules.least_cosine &&
           std::fabs(dot(fit.normal, middle) + fit.offset) <= set_.rules.gate(patch);
}

// Fills members_, which is also the queue, with what hangs together with the first patch (marked kQueued);
// *fit is the plane of all. Refitted whenever the region has doubled, so the cost stays linear.
std::uint32_t PlaneLayer::grow(std::uint32_t first, PlaneFit* fit) {
    Scatter sums;
    std::uint32_t count = 0, refit_at = 2;
    const auto take_in = [&](std::uint32_t entry, std::uint32_t i) {
        Patch& patch = chunks_[entry].patch[i];
        patch.plane = kQueued;
        sums.add(patch.scatter(centre_of(overlay_.key(entry))));
        members_[count++] = 4 * entry + i;
        if (count < refit_at) return;
        *fit = fit_plane(sums, fit->normal);
        refit_at *= 2;
    };
    const Patch& seed = chunks_[first >> 2].patch[first & 3];
    fit->normal = seed.unit_normal();
    fit->offset = -dot(fit->normal, seed.middle(centre_of(overlay_.key(first >> 2))));
    take_in(first >> 2, first & 3);
    for (std::uint32_t m = 0; m < count; ++m) {
        const Vec3i c = unpack_key(overlay_.key(members_[m] >> 2));
        for (int i = 0; i < 27; ++i) {
            const Vec3i beside{c.x + i % 3 - 1, c.y + i / 3 % 3 - 1, c.z + i / 9 - 1};
            const std::uint32_t entry = chunk_in_range(beside) ? overlay_.find(pack_key(beside)) : kNoChunk;
            if (entry == kNoChunk) continue;
            for (std::uint32_t k = 0; k < chunks_[entry].count && count < options_.chunks; ++k) {
                const Patch& patch = chunks_[entry].patch[k];
                if (patch.plane == kNoPlane && agrees(*fit, patch, patch.middle(centre_of(pack_key(beside)))))
                    take_in(entry, k);
            }
        }
    }
    *fit = fit_plane(sums, fit->normal);
    return count;
}

}  // namespace burin
