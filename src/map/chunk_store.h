// SPDX-License-Identifier: MIT
// Chunks that found no room in memory: they go to a file, farthest from the view first, and come back when a
// frame would read or change them. What a chunk comes to does not depend on where it was in between, so a map
// fused with a store is bit for bit the map that a larger budget would have held.
#pragma once

#include <cstdint>
#include <span>

#include "map/chunk_index.h"
#include "map/chunk_reader.h"
#include "map/group_writer.h"
#include "map/store_file.h"
#include "map/store_io.h"
#include "map/volume.h"

namespace burin {

class ChunkStore {
  public:
    ChunkStore() = default;
    ~ChunkStore() {  // what is queued still goes to the file, so the file goes last
        close();
        reader_.stop();
        writer_.stop();
    }
    ChunkStore(const ChunkStore&) = delete;
    ChunkStore& operator=(const ChunkStore&) = delete;

    // `chunks`: room in the index; 0: there will be no store, and nothing is allocated.
    void place(Arena& arena, const VolumeShape& shape, std::uint32_t chunks);
    void clear();    // after place
    Status start();  // its threads, unless they run

    // A new file, or one to go on from: the volume, which must be empty, is then the map of its last commit,
    // all of it away. `head`: the caller's configuration.
    Status create(const char* path, StoreHead head);
    Status resume(const char* path, std::uint64_t* frames);
    // The same with an I/O of the caller's, which must outlive close(). `fresh`: write the head first.
    Status attach(StoreIo* io, bool fresh, StoreHead head, const char* name, std::uint64_t* frames);
    void close();
    bool is_open() const { return io_ != nullptr; }

    // Is the chunk in the store and not in the volume?
    bool holds(ChunkKey key) const {
        if (!is_open()) return false;
        const ChunkIndex::Entry* entry = index_.find(key);
        return entry && !entry->resident();
    }
    std::uint32_t away() const { return away_; }  // chunks that holds() is true for

    // Chunks that were ever sent to the file, and a box around them.
    std::uint32_t known() const { return index_.count(); }
    Vec3i low() const { return low_; }
    Vec3i high() const { return high_; }

    // Around where the next frames look, in chunks: what is farthest from there leaves first.
    void look_at(Vec3i centre) { centre_ = centre; }
    // Evicts until `chunks` are free (some more, to do it rarely). Moves chunks to other slots; those that
    // are pinned stay in memory. False when there are still fewer: everything is pinned, or the disk or the
    // index full.
    bool make_room(Volume& volume, std::uint32_t chunks);
    // bring() will be called for chunks: the reader may begin. read_ahead: false when it has its hands full,
    // and the key is to be told again after the next bring(). begin_reading: what was told before is no
    // longer wanted.
    void begin_reading() { reader_.give_up(); }
    bool read_ahead(ChunkKey key);
    // Brings a chunk back for which holds() is true, evicting others when the pool is full. kNoChunk: no
    // room, or unreadable.
    std::uint32_t bring(Volume& volume, ChunkKey key);
    // Its bytes (geometry, then colour) without bringing it; valid until the next call. Null: unreadable.
    const void* read(const ChunkIndex::Entry& entry);

    // Calls visit(entry) for chunks that are away, until it returns false. visit may bring chunks.
    template <class Visit>
    void for_each_away(Visit&& visit) const {
        for (std::uint32_t i = 0; i < index_.size(); ++i)
            if (index_.at(i).key != 0 && !index_.at(i).resident() && !visit(index_.at(i))) return;
    }
    const ChunkIndex::Entry* entry(ChunkKey key) const { return index_.find(key); }

    // The next keys after `after` of the volume and of what is away, ascending; none when there are no more.
    // Visiting everything takes a walk over all for each kWalk chunks, which is the price of fixed memory.
    std::span<const ChunkKey> next_keys(const Volume& volume, ChunkKey after);

    // Makes what the map is now what a crash leaves. Writes every changed chunk and waits for the disk.
    Status commit(Volume& volume, std::uint64_t frames);
    // Nothing of the map is valid any more.
    void forget();
    // Once a frame, with the chunk in the middle of its view: a disk that refused is asked again.
    void begin_frame(Vec3i centre);

    struct Counts {
        std::uint64_t evicted = 0, reloaded = 0;
        std::uint64_t bytes = 0;  // of the file
        bool full = false;        // this frame: the disk or the index had no room
        bool failed = false;      // this frame: the disk refused, or a chunk was unreadable
        int disk_error = 0;       // errno, 0 while the disk takes what it is given
    };
    Counts counts() const;

  private:
    ChunkIndex::Entry* enter(ChunkKey key);
    bool save(Volume& volume, std::uint32_t slot);
    bool evict(Volume& volume, std::uint32_t slot);
    std::uint32_t distance_bin(ChunkKey key) const;

    ChunkIndex index_;
    GroupWriter writer_;
    ChunkReader reader_;
    FileIo file_;
    StoreIo* io_ = nullptr;
    VolumeShape shape_;
    Vec3i centre_, low_, high_;
    static constexpr std::uint32_t kWalk = 4096;  // 32 KiB
    unsigned char* page_ = nullptr;               // one chunk that the reader was not told of
    ChunkKey* walk_ = nullptr;                    // kWalk
    std::uint32_t away_ = 0;
    std::uint64_t evicted_ = 0, reloaded_ = 0;
    bool full_ = false, unreadable_ = false;
    char name_[200] = "";  // for messages, cut when longer
};

}  // namespace burin
