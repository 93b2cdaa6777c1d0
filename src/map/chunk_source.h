// SPDX-License-Identifier: MIT
// All chunks of a map in key order, wherever they are: for digests and for the map file.
#pragma once

#include <cstdint>
#include <span>

#include "map/chunk_store.h"
#include "map/volume.h"

namespace burin {

class ChunkSource {
  public:
    virtual ~ChunkSource() = default;
    struct Chunk {
        ChunkKey key = 0;
        std::uint64_t checksum = 0;
        const ChunkGeometry* geometry = nullptr;
        const ChunkColour* colour = nullptr;  // null without colour
    };
    virtual std::uint32_t count() const = 0;
    virtual void rewind() = 0;
    // The next chunk; with_voxels: also its bytes, valid until the next call. False: the end, or it is
    // unreadable.
    virtual bool next(Chunk* chunk, bool with_voxels) = 0;
    // Volume::hash over all.
    std::uint64_t hash();
};

class VolumeSource final : public ChunkSource {
  public:
    // scratch: volume.live() entries.
    VolumeSource(const Volume& volume, std::uint32_t* scratch);
    std::uint32_t count() const override { return volume_.live(); }
    void rewind() override { at_ = 0; }
    bool next(Chunk* chunk, bool with_voxels) override;

  private:
    const Volume& volume_;
    const std::uint32_t* order_;
    std::uint32_t at_ = 0;
};

class StoreSource final : public ChunkSource {
  public:
    StoreSource(const Volume& volume, ChunkStore& store) : volume_(volume), store_(store) {}
    std::uint32_t count() const override { return volume_.live() + store_.away(); }
    void rewind() override {
        keys_ = {};
        last_ = 0;
    }
    bool next(Chunk* chunk, bool with_voxels) override;

  private:
    const Volume& volume_;
    ChunkStore& store_;
    std::span<const ChunkKey> keys_;
    ChunkKey last_ = 0;
};

}  // namespace burin
