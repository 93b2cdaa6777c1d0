// SPDX-License-Identifier: MIT
#include "planes/stability.h"

#include <algorithm>
#include <cmath>

#include "mesh/mesher.h"

namespace burin::bench {
namespace {

struct Edge {
    std::uint64_t edge;
    float along;
    Vec3f at;
};

// Vertices of one chunk by their edges, in order. Voxels are at half numbers of voxels from the origin.
void edges_of(const SurfaceField& field, Vec3i chunk, std::vector<Edge>* out) {
    thread_local std::vector<float> positions(3 * kMaxChunkVertices);
    thread_local std::vector<std::uint32_t> triangles(3 * kMaxChunkTriangles);
    out->clear();
    const MeshCounts counts = mesh_chunk(field, Neighbourhood(field, chunk), {},
                                         {positions.data(), nullptr, nullptr, triangles.data()});
    const double per_m = 1 / static_cast<double>(field.voxel_m());
    for (std::uint64_t v = 0; v < counts.vertices; ++v) {
        Vec3d g;
        int axis = 0;
        double off[3];
        for (int r = 0; r < 3; ++r) {
            g[r] = static_cast<double>(positions[3 * v + static_cast<std::uint64_t>(r)]) * per_m - 0.5;
            off[r] = std::fabs(g[r] - std::round(g[r]));
            if (off[r] > off[axis]) axis = r;
        }
        if (off[axis] < 1e-3) continue;  // at a voxel: which of its edges it is on cannot be told
        std::uint64_t edge = static_cast<std::uint64_t>(axis);
        bool inside = true;  // the chunk's own edges, those that begin in it
        for (int r = 0; r < 3; ++r) {
            const auto place = static_cast<std::int64_t>(r == axis ? std::floor(g[r]) : std::round(g[r]));
            inside = inside && place >> 3 == chunk[r];
            edge = edge << 20 | static_cast<std::uint64_t>(place + (1 << 19));
        }
        if (!inside) continue;
        out->push_back({edge,
                        static_cast<float>(g[axis]),
                        {positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]}});
    }
    std::sort(out->begin(), out->end(), [](const Edge& a, const Edge& b) { return a.edge < b.edge; });
}

Vec3i low_end(std::uint64_t edge, int* axis) {
    *axis = static_cast<int>(edge >> 60);
    Vec3i v;
    for (int r = 0; r < 3; ++r)
        v[r] = static_cast<std::int32_t>(edge >> (20 * (2 - r)) & 0xfffff) - (1 << 19);
    return v;
}

bool seen(const Volume& volume, std::uint64_t edge, int observations) {
    int axis = 0;
    Vec3i v = low_end(edge, &axis);
    for (int end = 0; end < 2; ++end, ++v[axis]) {
        const Vec3i c{v.x >> 3, v.y >> 3, v.z >> 3};
        const std::uint32_t slot = chunk_in_range(c) ? volume.find(pack_key(c)) : kNoChunk;
        if (slot == kNoChunk) return false;
        // One observation weighs 64.
        if (volume.geometry(slot).weight[(v.z & 7) << 6 | (v.y & 7) << 3 | (v.x & 7)] < 64 * observations)
            return false;
    }
    return true;
}

// The told planes and where each was seen.
class Extents {
  public:
    explicit Extents(PlaneLayer& layer) {
        for (std::uint32_t i = 0; i < layer.set().used(); ++i) {
            if (!layer.told(layer.set().at(i))) continue;
            ExtentGrid grid;
            OutlineCounts counts;
            layer.outline(static_cast<std::uint16_t>(i), false, &grid, &counts);
            if (counts.points == 0) continue;
            const CellGrid& g = grid.grid;
            planes_.push_back({grid, {g.cells, g.cells + std::size_t(g.width) * std::size_t(g.height)}});
        }
    }
    bool hold(Vec3d x, double voxel) const {
        for (const Plane& p : planes_) {
            const ExtentGrid& g = p.grid;
            if (!(std::fabs(dot(g.normal, x) + g.offset) <= voxel)) continue;
            const auto cell = [&](int axis, std::int32_t first) {
                return static_cast<std::int64_t>(std::floor(x[axis] / voxel / g.step)) - first;
            };
            const std::int64_t u = cell(g.across, g.u0), v = cell(g.along, g.v0);
            if (u >= 0 && v >= 0 && u < g.grid.width && v < g.grid.height &&
                p.cells[static_cast<std::size_t>(v * g.grid.width + u)] == kCellSeen)
                return true;
        }
        return false;
    }
    bool empty() const { return planes_.empty(); }

  private:
    struct Plane {
        ExtentGrid grid;
        std::vector<std::uint8_t> cells;
    };
    std::vector<Plane> planes_;
};

}  // namespace

void Stability::take(Mapping& mapping, int frames) {
    if (frames % options_.every != 0) return;
    FusionSession& session = mapping.session();
    if (options_.refresh) session.refresh_planes(mapping.jobs());
    const Volume& volume = session.volume();
    std::vector<Edge> with, without;
    now_.clear();
    for (std::uint32_t slot = 0; slot < volume.live(); ++slot) {
        const Vec3i chunk = unpack_key(volume.key(slot));
        edges_of(volume, chunk, &without);
        if (without.empty()) continue;
        edges_of(session.surface(), chunk, &with);
        for (std::size_t i = 0, k = 0; i < without.size(); ++i) {
            while (k < with.size() && with[k].edge < without[i].edge) ++k;
            if (k == with.size() || with[k].edge != without[i].edge) continue;
            now_.push_back({without[i].edge, with[k].along, without[i].along, without[i].at, slot});
        }
    }
    std::sort(now_.begin(), now_.end(), [](const Vertex& a, const Vertex& b) { return a.edge < b.edge; });
    const Extents extents(session.planes());
    const double voxel = static_cast<double>(volume.voxel_m());
    if (!last_.empty() && !extents.empty()) {
        ++pairs_;
        std::size_t k = 0;
        for (const Vertex& v : now_) {
            while (k < last_.size() && last_[k].edge < v.edge) ++k;
            if (k == last_.size()) break;
            const Vertex& before = last_[k];
            if (before.edge != v.edge || volume.last_seen(v.slot) <= last_frames_ ||
                !seen(volume, v.edge, options_.least_seen + options_.every) ||
                !extents.hold(to_double(v.at), voxel))
                continue;
            motion_.with.push_back(std::fabs(static_cast<double>(v.with - before.with)) * voxel);
            motion_.without.push_back(std::fabs(static_cast<double>(v.without - before.without)) * voxel);
        }
    }
    last_.swap(now_);
    last_frames_ = session.frames();
}

}  // namespace burin::bench
