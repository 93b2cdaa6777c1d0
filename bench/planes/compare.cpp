// SPDX-License-Identifier: MIT
#include "planes/compare.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "mesh/mesher.h"
#include "planes/candidates.h"
#include "support/frames.h"

namespace burin::bench {
namespace {

// See header.
class Judge {
  public:
    Judge(const std::vector<LabelledPlane>& truth, double voxel_m) : truth_(truth), near_m_(2 * voxel_m) {
        for (const LabelledPlane& p : truth) rasters_.emplace_back(p.normal, p.offset, p.rings, 0.01);
    }
    // Which true plane it is on, -1 for none.
    int judge(const Candidate& c, CandidateFigures* out) const {
        constexpr double kLeastCosine = 0.94;  // 20 degrees
        ++out->found;
        int best = -1;
        double nearest = near_m_;
        for (std::size_t t = 0; t < truth_.size(); ++t) {
            const double d = std::fabs(dot(truth_[t].normal, c.centre) + truth_[t].offset);
            if (!(d <= nearest) || dot(truth_[t].normal, c.normal) < kLeastCosine ||
                !rasters_[t].contains(c.centre))
                continue;
            nearest = d;
            best = static_cast<int>(t);
        }
        if (best < 0) return best;
        ++out->on_planes;
        const Vec3d n = truth_[static_cast<std::size_t>(best)].normal;
        out->angle_deg.push_back(std::atan2(norm(cross(n, c.normal)), dot(n, c.normal)) * 57.29577951308232);
        out->distance_mm.push_back(1e3 * nearest);
        return best;
    }

  private:
    const std::vector<LabelledPlane>& truth_;
    double near_m_;
    std::vector<PlaneRaster> rasters_;
};

struct ChunkVertices {
    std::vector<float> positions, normals;
    std::uint64_t count = 0;
};

// As PlaneLayer::list_due chooses: chunks with surface.
std::vector<std::uint32_t> chunks_with_surface(const Volume& volume) {
    std::vector<std::uint32_t> slots;
    const float near = 1.75f * volume.voxel_m() / volume.units_to_m();
    for (std::uint32_t slot = 0; slot < volume.live(); ++slot)
        if (static_cast<float>(volume.least_distance(slot)) <= near) slots.push_back(slot);
    return slots;
}

}  // namespace

CandidateComparison compare_candidates(const Mapping& mapping, const std::vector<LabelledPlane>& truth,
                                       const RansacOptions& options) {
    const Volume& volume = mapping.session().volume();
    const PlaneLayer& layer = mapping.session().planes();
    const std::vector<std::uint32_t> slots = chunks_with_surface(volume);
    const double per_chunk = 1e3 / static_cast<double>(std::max<std::size_t>(slots.size(), 1));
    CandidateComparison out;
    out.chunks = static_cast<int>(slots.size());
    std::vector<std::vector<Patch>> patches(slots.size());
    std::vector<ChunkVertices> vertices(slots.size());
    std::vector<std::vector<Candidate>> planes(slots.size());
    std::vector<float> positions(3 * kMaxChunkVertices), normals(3 * kMaxChunkVertices);
    std::vector<std::uint32_t> triangles(3 * kMaxChunkTriangles);
    double best[3] = {1e30, 1e30, 1e30};  // ms of all chunks
    for (int pass = 0; pass < 3; ++pass) {
        double start = cpu_ms();
        for (std::size_t i = 0; i < slots.size(); ++i) {
            Patch found[kChunkPlanes];
            const int count = find_candidates(volume, slots[i], found);
            patches[i].assign(found, found + count);
        }
        best[0] = std::min(best[0], cpu_ms() - start);
        start = cpu_ms();
        for (std::size_t i = 0; i < slots.size(); ++i) {
            const MeshCounts counts =
                mesh_chunk(volume, Neighbourhood(volume, unpack_key(volume.key(slots[i]))), {},
                           {positions.data(), normals.data(), nullptr, triangles.data()});
            vertices[i].count = counts.vertices;
            const auto end = static_cast<std::ptrdiff_t>(3 * counts.vertices);
            vertices[i].positions.assign(positions.begin(), positions.begin() + end);
            vertices[i].normals.assign(normals.begin(), normals.begin() + end);
        }
        best[1] = std::min(best[1], cpu_ms() - start);
        std::uint64_t state = 1;
        start = cpu_ms();
        for (std::size_t i = 0; i < slots.size(); ++i)
            planes[i] = ransac_planes(vertices[i].positions.data(), vertices[i].normals.data(),
                                      vertices[i].count, options, &state);
        best[2] = std::min(best[2], cpu_ms() - start);
    }
    out.distances.us_per_chunk = best[0] * per_chunk;
    out.mesh_us_per_chunk = best[1] * per_chunk;
    out.ransac.us_per_chunk = best[2] * per_chunk;
    const Judge judge(truth, static_cast<double>(volume.voxel_m()));
    for (std::size_t i = 0; i < slots.size(); ++i) {
        const Vec3d centre = layer.centre_of(volume.key(slots[i]));
        struct OnPlane {
            double deg, mm;
        };
        std::map<int, OnPlane> ours;
        const auto last = [](const CandidateFigures& f) {
            return OnPlane{f.angle_deg.back(), f.distance_mm.back()};
        };
        for (const Patch& p : patches[i]) {
            const Vec3d middle{p.p[0], p.p[1], p.p[2]};
            const int plane = judge.judge(
                {p.unit_normal(), centre + middle * (1 / static_cast<double>(p.n)), 0}, &out.distances);
            if (plane >= 0) ours.try_emplace(plane, last(out.distances));
        }
        for (const Candidate& c : planes[i]) {
            const int plane = judge.judge(c, &out.ransac);
            const auto same = ours.find(plane);
            if (plane < 0 || same == ours.end()) continue;
            const OnPlane theirs = last(out.ransac);
            out.both_least_squares_deg.push_back(same->second.deg);
            out.both_least_squares_mm.push_back(same->second.mm);
            out.both_ransac_deg.push_back(theirs.deg);
            out.both_ransac_mm.push_back(theirs.mm);
            ours.erase(same);
        }
    }
    return out;
}

}  // namespace burin::bench
