// SPDX-License-Identifier: MIT
#include "map/sample_batch.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "map/sample.h"

namespace burin {
namespace {

using simd::kNoCell;
using simd::kSampleBatch;

// What is added to a key for the next chunk in x, y, z.
constexpr ChunkKey kNext[3] = {1, ChunkKey{1} << 21, ChunkKey{1} << 42};

std::uint32_t pair_at(const void* voxels) {
    std::uint32_t pair;
    std::memcpy(&pair, voxels, 4);
    return pair;
}

// Asks for the lines that a cell reads in its chunk: rows of 8 voxels (16 bytes), planes of 128 bytes. The
// second row lies in the same line for three of four.
void prefetch_cell(const ChunkGeometry& g, int index) {
    const int above = std::min(index + 64, kChunkVoxels - 1);
    __builtin_prefetch(&g.sdf[index]);
    __builtin_prefetch(&g.sdf[above]);
    __builtin_prefetch(&g.weight[index]);
    __builtin_prefetch(&g.weight[above]);
}

}  // namespace

LatticeFrame::LatticeFrame(const Volume& volume, const Se3& T_world_body) {
    const double inverse_voxel = 1.0 / volume.voxel_m();
    for (int r = 0; r < 3; ++r) {
        // The API keeps poses within what keys can tell; whatever else comes here finds no chunk.
        const double limit = (kChunkLimit - 2.0) * kChunkSide;
        const double at = T_world_body.t[r] * inverse_voxel - 0.5;
        const double voxel = std::fabs(at) < limit ? kChunkSide * std::floor(at / kChunkSide) : 0.0;
        origin[r] = static_cast<std::int32_t>(voxel);
        map.offset[r] = static_cast<float>(at - voxel);
        for (int c = 0; c < 3; ++c)
            map.m[3 * r + c] = static_cast<float>(T_world_body.R(r, c) * inverse_voxel);
    }
}

BatchSampler::BatchSampler(const Volume& volume)
    : volume_(volume), inverse_voxel_(1.0 / volume.voxel_m()), scale_(sample_scale(volume)), memo_(volume) {}

void BatchSampler::load_corners(int count, CellChunks* chunks_of) {
    constexpr std::uint32_t kUnknown = kNoChunk - 1;
    ChunkKey keys[kSampleBatch];
    std::uint32_t slots[kSampleBatch];
    std::uint8_t index_in_border[kSampleBatch];
    std::uint32_t border[kSampleBatch][8];  // chunks of the corners of cells that lie in several
    constexpr std::uint8_t kWhole = 255;    // the cell lies in one chunk
    const auto& v = cells_.v;
    const auto crosses = [&](int i, int k) { return (v[k][i] & 7) == 7; };

    // Hash entries first: those that the memo lacks are on their way while the others are asked for.
    for (int i = 0; i < count; ++i) {
        if (v[0][i] == kNoCell) {
            keys[i] = 0;
            continue;
        }
        const ChunkKey key = pack_key({v[0][i] >> 3, v[1][i] >> 3, v[2][i] >> 3});
        keys[i] = key;
        if (chunks_of && chunks_of[i].key == key) continue;
        memo_.prefetch(key);
        for (int k = 0; k < 3; ++k)
            if (crosses(i, k)) memo_.prefetch(key + kNext[k]);
    }
    // Then slots, and the voxels are asked for.
    int borders = 0;
    for (int i = 0; i < count; ++i) {
        index_in_border[i] = kWhole;
        CellChunks* remembered = chunks_of ? chunks_of + i : nullptr;
        if (remembered && remembered->key == keys[i] && keys[i] != 0) {
            slots[i] = remembered->slot[0];
        } else {
            slots[i] = keys[i] == 0 ? kNoChunk : memo_.find(keys[i]);
            if (remembered) {
                remembered->key = keys[i];
                remembered->slot[0] = slots[i];
                std::fill_n(remembered->slot + 1, 7, kUnknown);
            }
        }
        if (slots[i] == kNoChunk) continue;
        const int index = voxel_index({v[0][i], v[1][i], v[2][i]});
        prefetch_cell(volume_.geometry(slots[i]), index);
        const bool across[3] = {crosses(i, 0), crosses(i, 1), crosses(i, 2)};
        if (!(across[0] || across[1] || across[2])) continue;
        std::uint32_t* chunks = border[borders];
        index_in_border[i] = static_cast<std::uint8_t>(borders++);
        for (int corner = 0; corner < 8; ++corner) {
            int same = corner;  // the lowest corner in the same chunk
            ChunkKey key = keys[i];
            for (int k = 0; k < 3; ++k)
                if (corner >> k & 1) {
                    if (across[k])
                        key += kNext[k];
                    else
                        same &= ~(1 << k);
                }
            if (same != corner) {
                chunks[corner] = chunks[same];
                continue;
            }
            // `same` is this corner: its bits are the axes along which the chunk is the next one.
            if (remembered) {
                if (remembered->slot[corner] == kUnknown) remembered->slot[corner] = memo_.find(key);
                chunks[corner] = remembered->slot[corner];
            } else {
                chunks[corner] = memo_.find(key);
            }
            if (corner == 0 || chunks[corner] == kNoChunk) continue;
            prefetch_cell(
                volume_.geometry(chunks[corner]),
                voxel_index({v[0][i] + (corner & 1), v[1][i] + (corner >> 1 & 1), v[2][i] + (corner >> 2)}));
        }
    }
    // Then the voxels themselves.
    for (int i = 0; i < count; ++i) {
        if (slots[i] == kNoChunk) {
            corners_.weight[0][i] = 0;
            continue;
        }
        const Vec3i low{v[0][i], v[1][i], v[2][i]};
        if (index_in_border[i] == kWhole) {
            const ChunkGeometry& g = volume_.geometry(slots[i]);
            const int index = voxel_index(low);
            constexpr int kRow[4] = {0, 8, 64, 72};
            for (int row = 0; row < 4; ++row) {
                corners_.sdf[row][i] = pair_at(&g.sdf[index + kRow[row]]);
                corners_.weight[row][i] = pair_at(&g.weight[index + kRow[row]]);
            }
            continue;
        }
        const std::uint32_t* chunks = border[index_in_border[i]];
        for (int row = 0; row < 4; ++row) {
            std::uint32_t sdf = 0, weight = 0;
            for (int x = 0; x < 2; ++x) {
                const std::uint32_t slot = chunks[2 * row + x];
                if (slot == kNoChunk) continue;
                const int at = voxel_index({low.x + x, low.y + (row & 1), low.z + (row >> 1)});
                const ChunkGeometry& g = volume_.geometry(slot);
                sdf |= static_cast<std::uint32_t>(static_cast<std::uint16_t>(g.sdf[at])) << 16 * x;
                weight |= static_cast<std::uint32_t>(g.weight[at]) << 16 * x;
            }
            corners_.sdf[row][i] = sdf;
            corners_.weight[row][i] = weight;
        }
    }
}

void BatchSampler::finish(int count, bool with_gradients, CellChunks* chunks) {
    load_corners(count, chunks);
    simd::interpolate_cells(corners_, cells_.t, count, scale_, distances_,
                            with_gradients ? gradients_ : nullptr);
}

void BatchSampler::sample(const LatticeFrame& frame, const float* x, const float* y, const float* z,
                          std::size_t count, float* distances, float* const* gradients, CellChunks* chunks) {
    constexpr std::int32_t kLimit = (kChunkLimit - 2) * kChunkSide;
    for (std::size_t start = 0; start < count; start += kSampleBatch) {
        const int n = static_cast<int>(std::min<std::size_t>(kSampleBatch, count - start));
        simd::locate_cells(frame.map, x + start, y + start, z + start, n, &cells_);
        for (int i = 0; i < n; ++i) {
            if (cells_.v[0][i] == kNoCell) continue;
            for (int k = 0; k < 3; ++k) cells_.v[k][i] += frame.origin[k];  // below 2^23 + 2^20
            for (int k = 0; k < 3; ++k)
                if (cells_.v[k][i] <= -kLimit || cells_.v[k][i] >= kLimit) cells_.v[0][i] = kNoCell;
        }
        finish(n, gradients != nullptr, chunks ? chunks + start : nullptr);
        std::copy_n(distances_, n, distances + start);
        if (gradients)
            for (int k = 0; k < 3; ++k) std::copy_n(gradients_[k], n, gradients[k] + start);
    }
}

void BatchSampler::sample(const double* points, std::size_t count, float* distances, float* gradients) {
    for (std::size_t start = 0; start < count; start += kSampleBatch) {
        const int n = static_cast<int>(std::min<std::size_t>(kSampleBatch, count - start));
        for (int i = 0; i < n; ++i) {
            const double* p = points + 3 * (start + static_cast<std::size_t>(i));
            Vec3i low;
            float t[3] = {};
            if (!cell_of({p[0], p[1], p[2]}, inverse_voxel_, &low, t)) low.x = kNoCell;
            for (int k = 0; k < 3; ++k) {
                cells_.v[k][i] = low[k];
                cells_.t[k][i] = t[k];
            }
        }
        finish(n, gradients != nullptr, nullptr);
        std::copy_n(distances_, n, distances + start);
        if (!gradients) continue;
        for (int i = 0; i < n; ++i)
            for (int k = 0; k < 3; ++k)
                gradients[3 * (start + static_cast<std::size_t>(i)) + static_cast<std::size_t>(k)] =
                    gradients_[k][i];
    }
}

}  // namespace burin
