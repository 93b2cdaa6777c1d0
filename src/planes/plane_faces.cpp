// SPDX-License-Identifier: MIT
// Which plane the faces of a mesh belong to.
#include <algorithm>
#include <cmath>

#include "planes/plane_layer.h"

namespace burin {

std::uint16_t PlaneLayer::plane_at(Vec3d x, Vec3d normal) const {
    Vec3i at;
    if (!voxel_at(x, static_cast<double>(shape_.voxel_m), &at)) return kNoPlane;
    const std::uint32_t entry = overlay_.find(pack_key(chunk_of_voxel(at)));
    if (entry == kNoChunk) return kNoPlane;
    const ChunkPlanes& chunk = chunks_[entry];
    std::uint16_t best = kNoPlane;
    // Half a voxel: what has joined a plane lies closer, but where it bends away to something else.
    double nearest = 0.5 * static_cast<double>(shape_.voxel_m);
    for (int i = 0; i < chunk.pulled; ++i) {
        const GlobalPlane& plane = set_.at(chunk.pull[i]);
        const double distance = std::fabs(plane.distance(x));
        // 40 degrees: triangles of marching cubes on a plane that is not quite reached tilt.
        if (plane.id == 0 || !(distance < nearest) || dot(plane.normal, normal) < 0.766) continue;
        nearest = distance;
        best = chunk.pull[i];
    }
    return best;
}

// Whether a plane that is no further than a voxel from x completes the column of the voxel.
bool PlaneLayer::fills_at(Vec3i voxel, Vec3d x) const {
    const std::uint32_t entry = overlay_.find(pack_key(chunk_of_voxel(voxel)));
    if (entry == kNoChunk) return false;
    const ChunkPlanes& chunk = chunks_[entry];
    for (int f = 0; f < chunk.fills; ++f) {
        const GlobalPlane& plane = set_.at(chunk.fill_plane[f]);
        const Axes axes(plane.normal);
        if (chunk.fill_cells[f] >> (8 * (voxel[axes.second] & 7) + (voxel[axes.first] & 7)) & 1 &&
            std::fabs(plane.distance(x)) < static_cast<double>(shape_.voxel_m))
            return true;
    }
    return false;
}

void PlaneLayer::label_faces(const float* positions, const std::uint32_t* triangles, std::uint64_t count,
                             std::uint8_t* labels, std::uint32_t* ids, std::uint8_t* filled,
                             const Volume& volume, Jobs& jobs) const {
    constexpr std::uint64_t kItem = 1024;  // triangles, some 100 us
    // Surface passes within a voxel of its voxel; seen aslant that reads up to twice as much.
    const float inside = -2.5f * volume.voxel_m() / volume.units_to_m();
    jobs.run(static_cast<int>((count + kItem - 1) / kItem), [&](int item, int) {
        const std::uint64_t first = static_cast<std::uint64_t>(item) * kItem;
        for (std::uint64_t t = first; t < std::min(count, first + kItem); ++t) {
            Vec3d corner[3];
            for (int k = 0; k < 3; ++k) {
                const float* p =
                    positions + 3 * std::uint64_t{triangles[3 * t + static_cast<std::uint64_t>(k)]};
                corner[k] = {p[0], p[1], p[2]};
            }
            const Vec3d middle = (corner[0] + corner[1] + corner[2]) * (1.0 / 3);
            const Vec3d normal = normalised(cross(corner[1] - corner[0], corner[2] - corner[0]));
            const std::uint16_t plane = plane_at(middle, normal);
            const bool known = plane != kNoPlane && told(set_.at(plane));
            if (labels) labels[t] = known ? set_.at(plane).label : 0;
            if (ids) ids[t] = known ? set_.at(plane).id : 0;
            if (!filled) continue;
            // Completed: the voxel there was never seen, or was inside something else.
            filled[t] = 0;
            Vec3i at;
            if (!voxel_at(middle, static_cast<double>(shape_.voxel_m), &at)) continue;
            const std::uint32_t slot = volume.find(pack_key(chunk_of_voxel(at)));
            filled[t] = slot == kNoChunk || volume.geometry(slot).weight[voxel_index(at)] == 0 ||
                        (static_cast<float>(volume.geometry(slot).sdf[voxel_index(at)]) < inside &&
                         fills_at(at, middle));
        }
    });
}

}  // namespace burin
