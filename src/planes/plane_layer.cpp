// SPDX-License-Identifier: MIT
#include "planes/plane_layer.h"

#include <algorithm>
#include <cmath>

#include "core/hash.h"
#include "simd/plane_fit.h"
#include "simd/tsdf.h"

namespace burin {
namespace {

constexpr std::uint32_t kKnownTurns =
    4;  // chunks that are drawn to planes already are fitted at every fourth

constexpr std::uint32_t kSlowTurns =
    8;  // chunks that did not change follow their planes at every eighth turn
// Voxels that differ from a plane by more than this are something else: four standard deviations of the fused
// surface there, but one voxel at least, so that a chunk that happens to be smooth joins, and two at most.
constexpr float kReachSigmas = 4, kLeastReach = 1, kMostReach = 2;  // the latter in voxels
// Observations that a patch of support counts for: a plane of a square metre (625 chunks at 5 mm) outweighs a
// voxel seen 255 times by 25 to 1, one of a quarter by 6 to 1.
constexpr float kObservationsPerPatch = 10;

// Whose turn it is: the same for all chunks of a block of 4x4x4, at random for blocks.
std::uint64_t block_turn(ChunkKey key) {
    constexpr ChunkKey kInBlock = 3u | 3ull << 21 | 3ull << 42;  // the low bits of each coordinate
    return (key & ~kInBlock) * 0x9e3779b97f4a7c15ULL >> 48;
}

}  // namespace

void PlaneLayer::place(Arena& arena, const PlaneOptions& options, const VolumeShape& shape) {
    options_ = options;
    shape_ = shape;
    const std::uint32_t chunks = options.enabled ? options.chunks : 0;
    overlay_.place(arena, chunks);
    if (!options.enabled) return;
    set_.place(arena, options.planes, 2 * options.planes);
    set_.rules = {};
    set_.rules.voxel_m = static_cast<double>(shape.voxel_m);
    extents_.place(arena, shape);
    shapes_ = arena.allocate<PlaneShape>(options.planes, 64);
    boxes_ = arena.allocate<PlaneExtent>(options.planes, 64);
    places_ = arena.allocate<std::uint16_t>(options.planes, 64);
    labels_ = arena.allocate<std::uint8_t>(options.planes, 64);
    outlines_ = arena.allocate<Vec3f>(kOutlinePoints, 64);
    chunks_ = arena.allocate<ChunkPlanes>(chunks, 64);
    turn_ = arena.allocate<std::uint32_t>(shape.capacity, 64);
    unassigned_ = arena.allocate<std::uint32_t>(chunks, 64);
    members_ = arena.allocate<std::uint32_t>(chunks, 64);
    work_ = arena.allocate<Work>(kBatch, 64);
}

void PlaneLayer::clear() {
    overlay_.clear();
    cameras_ = {};
    has_up_ = false;
    if (!options_.enabled) return;
    set_.clear();
    random_ = 0;
    dropped_ = 0;
    labelled_up_ = {0, 0, 1};
    unassigned_count_ = 0;
    described_ = 0;
}

Vec3d PlaneLayer::centre_of(ChunkKey key) const {
    const Vec3i c = unpack_key(key);
    const double side = kChunkSide * static_cast<double>(shape_.voxel_m);
    return {(c.x + 0.5) * side, (c.y + 0.5) * side, (c.z + 0.5) * side};
}

// Chunks of a block of 4x4x4 have their turn together, as for meshing (mesh/changes.cpp): neighbours then see
// the same planes. Free space has none.
std::uint32_t PlaneLayer::list_due(Volume& volume, std::uint64_t frame) {
    // Only chunks with surface hold planes. A voxel beside it is within half a voxel of it along the normal,
    // and the distances are stretched where the view was slanted.
    const float near = 1.75f * shape_.voxel_m / volume.units_to_m();
    const std::uint64_t interval = std::uint64_t{1} << options_.turn_bits, slow = interval * kSlowTurns;
    std::uint32_t count = 0;
    for (std::uint32_t slot = 0; slot < volume.live(); ++slot) {
        const bool changed = volume.flags(slot) & kChunkUnfitted;
        if (!changed && volume.over(slot) == kNoChunk) continue;
        if (static_cast<float>(volume.least_distance(slot)) > near) {
            // Passed over until it changes again.
            volume.flags(slot) = static_cast<std::uint8_t>(volume.flags(slot) & ~kChunkUnfitted);
            continue;
        }
        const std::uint64_t every = !changed                        ? slow
                                    : volume.over(slot) == kNoChunk ? interval
                                                                    : interval * kKnownTurns;
        if ((block_turn(volume.key(slot)) + frame) & (every - 1)) continue;
        if (!changed && chunks_[volume.over(slot)].revision == set_.revision()) continue;
        turn_[count++] = slot;
    }
    std::sort(turn_, turn_ + count,
              [&volume](std::uint32_t a, std::uint32_t b) { return volume.key(a) < volume.key(b); });
    return count;
}

// With a store, chunks leave the map while their entries stay, since planes last longer than a look at them;
// but when the room is needed they go, and their patches leave the planes.
void PlaneLayer::make_room(Volume& volume) {
    for (std::uint32_t entry = overlay_.count(); entry-- > 0;) {
        const ChunkKey key = overlay_.key(entry);
        if (overlay_.alone(entry) || volume.find(key) != kNoChunk) continue;
        const Vec3d centre = centre_of(key);
        for (int i = 0; i < chunks_[entry].count; ++i) {
            const Patch& patch = chunks_[entry].patch[i];
            if (patch.plane != kNoPlane) set_.take(patch.plane, patch, centre);
        }
        const std::uint32_t last = overlay_.count() - 1;
        if (const std::uint32_t slot = volume.find(overlay_.key(last)); slot != kNoChunk && entry != last)
            if (volume.over(slot) == last) volume.over(slot) = entry;
        overlay_.remove(entry);
        chunks_[entry] = chunks_[last];
    }
    set_.refit();
}

void PlaneLayer::update(Volume& volume, std::uint64_t frame, Jobs& jobs) {
    if (!options_.enabled) return;
    // An eighth of the room is more than a frame takes; and a look through all entries then frees many.
    if (frame % 16 == 0 && overlay_.count() > overlay_.capacity() - overlay_.capacity() / 8)
        make_room(volume);
    const std::uint32_t count = list_due(volume, frame);
    process(volume, turn_, count, jobs);
    // Hypotheses cost a walk over the patches without a plane: a few a frame.
    if (frame % 16 == 0) seed(8);
    if (frame % 16 == 8) merge_planes();
    set_.refit();
    draw(volume, turn_, count, jobs);
}

void PlaneLayer::process(Volume& volume, const std::uint32_t* slots, std::uint32_t count, Jobs& jobs) {
    for (std::uint32_t first = 0; first < count; first += kBatch) {
        const std::uint32_t some = std::min(kBatch, count - first);
        jobs.run_pieces(some, kPerItem, [&](std::size_t i) {
            Work& work = work_[i];
            work.slot = slots[first + i];
            work.found = -1;
            if (!(volume.flags(work.slot) & kChunkUnfitted)) return;
            work.found = static_cast<std::int8_t>(find_candidates(volume, work.slot, work.patch));
        });
        for (std::uint32_t i = 0; i < some; ++i) assign(volume, work_[i]);
    }
}

void PlaneLayer::assign(Volume& volume, Work& work) {
    const ChunkKey key = volume.key(work.slot);
    const Vec3d centre = centre_of(key);
    std::uint32_t entry = overlay_.find(key);
    if (work.found < 0) {
        if (entry != kNoChunk) check_patches(entry);
        return;
    }
    volume.flags(work.slot) = static_cast<std::uint8_t>(volume.flags(work.slot) & ~kChunkUnfitted);
    if (entry == kNoChunk) {
        if (work.found == 0) return;
        entry = overlay_.insert(key);
        if (entry == kNoChunk) {
            ++dropped_;
            return;
        }
        chunks_[entry].begin();
    }
    ChunkPlanes& chunk = chunks_[entry];
    for (int i = 0; i < chunk.count; ++i)
        if (chunk.patch[i].plane != kNoPlane) set_.take(chunk.patch[i].plane, chunk.patch[i], centre);
    chunk.count = static_cast<std::uint8_t>(work.found);
    for (int i = 0; i < work.found; ++i) {
        Patch& patch = chunk.patch[i] = work.patch[i];
        patch.plane = set_.match(patch, centre);
        if (patch.plane != kNoPlane) set_.add(patch.plane, patch, centre);
    }
}

// Planes have moved since a patch joined: it may have to leave, or there may be one for it now.
void PlaneLayer::check_patches(std::uint32_t entry) {
    ChunkPlanes& chunk = chunks_[entry];
    const Vec3d centre = centre_of(overlay_.key(entry));
    for (int i = 0; i < chunk.count; ++i) {
        Patch& patch = chunk.patch[i];
        const std::uint16_t best = set_.match(patch, centre);
        // To stay takes less than to come: no patch goes to and fro.
        constexpr double kSlack = 1.3;
        if (best == patch.plane || (patch.plane != kNoPlane && best == kNoPlane &&
                                    set_.fits(set_.at(patch.plane), patch, centre, kSlack)))
            continue;
        if (patch.plane != kNoPlane) set_.take(patch.plane, patch, centre);
        patch.plane = best;
        if (best != kNoPlane) set_.add(best, patch, centre);
    }
}

bool PlaneLayer::merge_planes() {
    std::uint16_t into, from;
    bool any = false;
    while (set_.find_merge(&into, &from)) {
        set_.merge(into, from);
        for (std::uint32_t entry = 0; entry < overlay_.count(); ++entry) {
            ChunkPlanes& chunk = chunks_[entry];
            for (int i = 0; i < chunk.count; ++i)
                if (chunk.patch[i].plane == from) chunk.patch[i].plane = into;
            // What it completed goes on with the other; a plane twice in the list does no harm.
            for (int f = 0; f < chunk.fills; ++f)
                if (chunk.fill_plane[f] == from) chunk.fill_plane[f] = into;
            for (int i = 0; i < chunk.pulled; ++i)
                if (chunk.pull[i] == from) chunk.pull[i] = into;
        }
        set_.refit();
        any = true;
    }
    return any;
}

void PlaneLayer::refresh(Volume& volume, const Vec3d* up_world, Jobs& jobs) {
    if (!options_.enabled) return;
    if (overlay_.count() > overlay_.capacity() - overlay_.capacity() / 8) make_room(volume);
    std::uint32_t count = 0;
    for (std::uint32_t slot = 0; slot < volume.live(); ++slot)
        if (volume.flags(slot) & kChunkUnfitted) turn_[count++] = slot;
    std::sort(turn_, turn_ + count,
              [&volume](std::uint32_t a, std::uint32_t b) { return volume.key(a) < volume.key(b); });
    process(volume, turn_, count, jobs);
    set_.refit();
    constexpr int kRounds = 4;  // patches that leave in one may found or join planes in the next
    for (int round = 0; round < kRounds; ++round) {
        int fails = 0;
        while (fails < 3) fails = seed(64) > 0 ? 0 : fails + 1;
        for (std::uint32_t entry = 0; entry < overlay_.count(); ++entry) check_patches(entry);
        set_.refit();
        merge_planes();
    }
    describe(volume, up_world);
    for (count = 0; count < volume.live(); ++count) turn_[count] = count;
    draw(volume, turn_, count, jobs);
    draw_alone(volume);
}

// Planes of the chunk itself come first, then those of its neighbours that reach into it.
void PlaneLayer::gather_pulls(const Volume& volume, Work* work) const {
    work->pulls = 0;
    int patches[4] = {};
    const ChunkKey key = volume.key(work->slot);
    const Vec3i c = unpack_key(key);
    const Vec3d centre = centre_of(key);
    const double voxel = static_cast<double>(shape_.voxel_m);
    for (int i = 0; i < 27; ++i) {
        const int at = i == 0 ? 13 : i <= 13 ? i - 1 : i;
        const Vec3i beside{c.x + at % 3 - 1, c.y + at / 3 % 3 - 1, c.z + at / 9 - 1};
        const std::uint32_t entry = chunk_in_range(beside) ? overlay_.find(pack_key(beside)) : kNoChunk;
        if (entry == kNoChunk) continue;
        const ChunkPlanes& chunk = chunks_[entry];
        for (int k = 0; k < chunk.count; ++k) {
            const Patch& patch = chunk.patch[k];
            if (patch.plane == kNoPlane) continue;
            const GlobalPlane& plane = set_.at(patch.plane);
            if (!told(plane)) continue;
            int p = 0;
            while (p < work->pulls && work->pull[p] != patch.plane) ++p;
            if (p == work->pulls) {
                const Vec3d n = plane.normal;
                const double reach =
                    (0.5 * kChunkSide * (std::fabs(n.x) + std::fabs(n.y) + std::fabs(n.z)) + 1) * voxel;
                if (p == 4 || std::fabs(plane.distance(centre)) > reach) continue;
                work->pull[work->pulls] = patch.plane;
                work->rms_m[work->pulls] = 0;
                work->stretch[work->pulls++] = 0;
            } else if (at != 13 && patches[p] < 0) {
                continue;  // the chunk's own patch tells it better
            }
            if (at == 13) {
                work->stretch[p] = patch.stretch;
                work->rms_m[p] = patch.rms_m;
                patches[p] = -1;
            } else {
                work->stretch[p] += patch.stretch;
                work->rms_m[p] += patch.rms_m;
                ++patches[p];
            }
        }
    }
    for (int p = 0; p < work->pulls; ++p)
        if (patches[p] > 0) {
            work->stretch[p] /= static_cast<float>(patches[p]);
            work->rms_m[p] /= static_cast<float>(patches[p]);
        }
}

void PlaneLayer::pull(Volume& volume, Work& work) {
    if (work.entry == kNoChunk) return;
    const Vec3d centre = centre_of(volume.key(work.slot));
    const float per_m = 1 / volume.units_to_m(), half_voxel = 0.5f * shape_.voxel_m * per_m;
    simd::Pull pulls[4];
    for (int p = 0; p < work.pulls; ++p) {
        const GlobalPlane& plane = set_.at(work.pull[p]);
        const float s = work.stretch[p];
        simd::PlaneModel& m = pulls[p].plane;
        for (int r = 0; r < 3; ++r) m.a[r] = static_cast<float>(plane.normal[r]) * (half_voxel * s);
        m.c = static_cast<float>(plane.distance(centre)) * (per_m * s);
        pulls[p].strength = simd::kWeightOne * kObservationsPerPatch * static_cast<float>(plane.patches);
        const float reach_m = std::clamp(kReachSigmas * work.rms_m[p], kLeastReach * shape_.voxel_m,
                                         kMostReach * shape_.voxel_m);
        pulls[p].reach = reach_m * per_m * s;
    }
    const ChunkGeometry& raw = volume.geometry(work.slot);
    ChunkGeometry& out = overlay_.geometry(work.entry);
    if (work.pulls > 0)
        simd::pull_to_planes(raw.sdf, raw.weight, pulls, work.pulls, out.sdf);
    else
        std::copy_n(raw.sdf, kChunkVoxels, out.sdf);
    std::copy_n(raw.weight, kChunkVoxels, out.weight);
    fill(work.entry, volume.units_to_m());
}

// Draws the distances of the chunks to their planes.
void PlaneLayer::draw(Volume& volume, const std::uint32_t* slots, std::uint32_t count, Jobs& jobs) {
    for (std::uint32_t first = 0; first < count; first += kBatch) {
        const std::uint32_t some = std::min(kBatch, count - first);
        jobs.run_pieces(some, kPerItem, [&](std::size_t i) {
            work_[i].slot = slots[first + i];
            gather_pulls(volume, &work_[i]);
        });
        for (std::uint32_t i = 0; i < some; ++i) {
            Work& work = work_[i];
            std::uint32_t& over = volume.over(work.slot);
            work.entry = kNoChunk;
            const std::uint32_t there = overlay_.find(volume.key(work.slot));
            if (work.pulls > 0 || (there != kNoChunk && chunks_[there].fills > 0)) {
                const std::uint32_t known = overlay_.count();
                work.entry = overlay_.insert(volume.key(work.slot));
                if (work.entry == kNoChunk)
                    ++dropped_;
                else if (work.entry == known)
                    chunks_[work.entry].begin();
            }
            // What is meshed changes: by much where the layer comes or goes, else by what planes move at a
            // time.
            const auto lag = static_cast<std::uint16_t>(static_cast<float>(set_.rules.lag_voxels) *
                                                        shape_.voxel_m / volume.units_to_m());
            if (work.entry != kNoChunk || over != kNoChunk) {
                volume.flags(work.slot) |= kChunkStale;
                volume.mesh_lag(work.slot) =
                    add_saturated(volume.mesh_lag(work.slot), over == work.entry ? lag : 65535);
            }
            over = work.entry;
            if (work.entry == kNoChunk) continue;
            overlay_.set_alone(work.entry, false);
            overlay_.set_stale(work.entry, false);  // the chunk's own flags tell
            ChunkPlanes& chunk = chunks_[work.entry];
            chunk.pulled = work.pulls;
            std::copy_n(work.pull, work.pulls, chunk.pull);
            chunk.revision = set_.revision();
        }
        jobs.run_pieces(some, kPerItem, [&](std::size_t i) { pull(volume, work_[i]); });
    }
}

}  // namespace burin
