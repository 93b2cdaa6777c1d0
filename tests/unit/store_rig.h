// SPDX-License-Identifier: MIT
// A disk in memory that can fail, and a store with chunks of known content, without a camera.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <vector>

#include "map/chunk_source.h"
#include "map/chunk_store.h"
#include "scene_helpers.h"

namespace burin {

// A file in memory that writes short, fills up, fails or dies after so many bytes.
class MemoryIo final : public StoreIo {
  public:
    std::vector<unsigned char> bytes;
    std::atomic<std::uint64_t> room{~0ull};  // bytes the disk has
    std::uint64_t life = ~0ull;              // bytes until the machine dies: nothing written later arrives
    std::size_t most = ~std::size_t{0};      // bytes a write takes
    std::atomic<bool> sync_fails{false}, read_fails{false};
    std::mutex mutex;  // reading and writing happen on two threads

    std::int64_t read(std::uint64_t at, void* to, std::size_t count) override {
        const std::lock_guard lock(mutex);
        if (read_fails) return -EIO;
        if (at >= bytes.size()) return 0;
        count = std::min({count, bytes.size() - static_cast<std::size_t>(at), most});
        std::memcpy(to, &bytes[at], count);
        return static_cast<std::int64_t>(count);
    }
    std::int64_t write(std::uint64_t at, const void* from, std::size_t count) override {
        const std::lock_guard lock(mutex);
        count = std::min(count, most);
        if (at >= room) return -ENOSPC;
        count = std::min<std::uint64_t>(count, room - at);
        const std::size_t arrives = std::min<std::uint64_t>(count, life);
        life -= arrives;
        if (arrives > 0) {
            bytes.resize(std::max<std::size_t>(bytes.size(), at + arrives));
            std::memcpy(&bytes[at], from, arrives);
        }
        return static_cast<std::int64_t>(count);
    }
    int sync() override { return sync_fails ? -EIO : 0; }
    std::int64_t size() override { return static_cast<std::int64_t>(bytes.size()); }
    int truncate(std::uint64_t count) override {
        bytes.resize(count);
        return 0;
    }
};

constexpr std::uint32_t kPool = 40, kKnown = 500;

// A pool, a store and chunks of known content, without a camera.
struct Rig {
    explicit Rig(bool with_colour, std::uint32_t known = kKnown) : shape{kPool, with_colour, 0.01f, 0.04f} {
        Arena measure;
        volume.place(measure, shape);
        store.place(measure, shape, known);
        memory = aligned_memory(measure.used());
        Arena arena(memory.get(), measure.used());
        volume.place(arena, shape);
        store.place(arena, shape, known);
        volume.clear();
        store.clear();
    }
    Status attach(StoreIo& io, bool fresh, std::uint64_t* frames = nullptr) {
        return store.attach(&io, fresh, {}, "memory", frames);
    }
    // Version `v` of chunk i: comes back, or is new. False: no room.
    bool put(int i, int v) {
        const ChunkKey key = pack_key({i, -i, 3});
        std::uint32_t slot = volume.find(key);
        if (slot == kNoChunk && store.holds(key)) {
            slot = store.bring(volume, key);
        } else if (slot == kNoChunk && store.make_room(volume, 1)) {
            slot = volume.insert(key);
        }
        if (slot == kNoChunk) return false;
        ChunkGeometry& g = volume.geometry(slot);
        for (int k = 0; k < kChunkVoxels; ++k) {
            g.sdf[k] = static_cast<std::int16_t>(g.sdf[k] + i * 7 + v + k);  // what was there counts
            g.weight[k] = static_cast<std::uint16_t>(1 + v);
        }
        if (shape.colour) volume.colour(slot).rgbn[i % 512][0] = static_cast<std::uint8_t>(v);
        volume.touch(slot);
        return true;
    }
    std::uint64_t hash() { return StoreSource(volume, store).hash(); }
    bool readable() {  // every byte of it
        StoreSource all(volume, store);
        std::uint32_t count = 0;
        for (ChunkSource::Chunk c; all.next(&c, true);) ++count;
        return count == all.count();
    }

    VolumeShape shape;
    Memory memory;
    Volume volume;
    ChunkStore store;
};

// Steps that any two runs make alike; returns the hash after each commit.
inline std::vector<std::uint64_t> write_history(Rig& rig, int commits, std::uint64_t seed) {
    std::vector<std::uint64_t> hashes = {rig.hash()};
    Rng rng(seed);
    for (int c = 1; c <= commits; ++c) {
        for (int i = 0; i < 60; ++i) EXPECT_TRUE(rig.put(rng.below(150), rng.below(100)));
        if (c == 3) {
            rig.volume.clear();
            rig.store.forget();
            EXPECT_TRUE(rig.put(5, 5));
        }
        hashes.push_back(rig.hash());
        EXPECT_TRUE(rig.store.commit(rig.volume, static_cast<std::uint64_t>(c)).ok());
    }
    return hashes;
}

}  // namespace burin
