// SPDX-License-Identifier: MIT
// The file under the store: it opens at its last commit whatever happened to its writer, and a full disk is a
// state.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "dataset_files.h"
#include "map/chunk_source.h"
#include "map/chunk_store.h"
#include "scene_helpers.h"

namespace burin {
namespace {

namespace fs = std::filesystem;

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
std::vector<std::uint64_t> write_history(Rig& rig, int commits, std::uint64_t seed) {
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

TEST(StoreFile, WhatWasCommittedIsReadBack) {
    for (const bool colour : {true, false}) {
        MemoryIo io;
        io.most = 1000;  // short writes and reads throughout
        std::vector<std::uint64_t> hashes;
        {
            Rig rig(colour);
            ASSERT_TRUE(rig.attach(io, true).ok());
            hashes = write_history(rig, 6, 1);
            rig.put(3, 9);  // not committed
            rig.store.close();
        }
        Rig again(colour);
        std::uint64_t frames = 0;
        const Status status = again.attach(io, false, &frames);
        ASSERT_TRUE(status.ok()) << status.text();
        EXPECT_EQ(frames, 6u);
        EXPECT_EQ(again.hash(), hashes.back());
        EXPECT_TRUE(again.readable());
        // And it goes on from there.
        for (int i = 0; i < 150; ++i) ASSERT_TRUE(again.put(i, 1));
        const std::uint64_t hash = again.hash();
        ASSERT_TRUE(again.store.commit(again.volume, 7).ok());
        again.store.close();
        Rig third(colour);
        ASSERT_TRUE(third.attach(io, false).ok());
        EXPECT_EQ(third.hash(), hash);
        Rig other(!colour);
        EXPECT_EQ(other.attach(io, false).code(), Code::invalid_argument);
        Rig small(colour, 50);
        EXPECT_EQ(small.attach(io, false).code(), Code::insufficient_memory);
    }
}

// The bytes that arrive end at any byte: of the last groups each, before them every so many.
TEST(StoreFile, CutAnywhereItOpensAtTheLastCommit) {
    MemoryIo io;
    Rig rig(true);
    ASSERT_TRUE(rig.attach(io, true).ok());
    std::vector<std::uint64_t> ends = {io.bytes.size()}, hashes = {rig.hash()};
    for (int c = 1; c <= 4; ++c) {
        for (int i = 0; i < 3; ++i) ASSERT_TRUE(rig.put(10 * c + i, c));
        ASSERT_TRUE(rig.store.commit(rig.volume, static_cast<std::uint64_t>(c)).ok());
        ends.push_back(io.bytes.size());
        hashes.push_back(rig.hash());
    }
    Rig again(true);
    for (std::size_t length = 0; length <= io.bytes.size(); length += length < ends[3] ? 509 : 1) {
        MemoryIo torn;
        torn.bytes.assign(io.bytes.begin(), io.bytes.begin() + static_cast<std::ptrdiff_t>(length));
        std::size_t last = ends.size();
        while (last > 0 && ends[last - 1] > length) --last;
        std::uint64_t frames = 99;
        const Status status = again.attach(torn, false, &frames);
        ASSERT_EQ(status.ok(), last > 0) << length << ": " << status.text();
        if (status.ok()) {
            ASSERT_EQ(frames, last - 1) << length;
            ASSERT_EQ(again.hash(), hashes[last - 1]) << length;
            ASSERT_EQ(torn.bytes.size(), ends[last - 1]) << "what follows is cut off";
        }
        again.store.close();
    }
}

TEST(StoreFile, AnyByteThatChangedIsFound) {
    for (const bool colour : {true, false}) {
        MemoryIo io;
        Rig rig(colour);
        ASSERT_TRUE(rig.attach(io, true).ok());
        for (int c = 1; c <= 2; ++c) {
            for (int i = 0; i < 3; ++i) ASSERT_TRUE(rig.put(10 * c + i, c));
            ASSERT_TRUE(rig.store.commit(rig.volume, static_cast<std::uint64_t>(c)).ok());
        }
        Rig again(colour);
        Rng rng(3);
        int older = 0;
        for (std::size_t at = 0; at < io.bytes.size(); ++at) {
            MemoryIo changed;
            changed.bytes = io.bytes;
            changed.bytes[at] = static_cast<unsigned char>(changed.bytes[at] ^ 1 << rng.below(8));
            std::uint64_t frames = 0;
            const Status status = again.attach(changed, false, &frames);
            // A damaged last mark cannot be told from one that was never finished: the commit before holds.
            const bool in_last_mark = at >= io.bytes.size() - kStorePage;
            ASSERT_EQ(status.ok(), in_last_mark) << at << ": " << status.text();
            older += status.ok() && frames == 1;
            ASSERT_TRUE(status.ok() || status.code() == Code::format || status.code() == Code::unsupported);
            again.store.close();
        }
        EXPECT_EQ(older, static_cast<int>(kStorePage));
    }
}

TEST(StoreFile, AFullDiskIsAStateAndWhatLeftIsNotLost) {
    MemoryIo io;
    Rig rig(true);
    ASSERT_TRUE(rig.attach(io, true).ok());
    for (int i = 0; i < 60; ++i) ASSERT_TRUE(rig.put(i, 1));
    ASSERT_TRUE(rig.store.commit(rig.volume, 1).ok());
    const std::uint64_t committed = rig.hash();
    io.room = io.bytes.size() + 50000;
    int refused = 0, i = 60;
    for (; i < 400; ++i) refused += !rig.put(i, 2);
    EXPECT_GT(refused, 100);
    EXPECT_LT(refused, 300) << "the buffers still took some";
    EXPECT_TRUE(rig.store.counts().full);
    EXPECT_FALSE(rig.store.counts().failed);
    EXPECT_EQ(rig.store.counts().disk_error, ENOSPC);
    EXPECT_TRUE(rig.readable()) << "from the buffers";
    EXPECT_EQ(rig.store.commit(rig.volume, 2).code(), Code::io);
    const std::uint64_t hash = rig.hash();
    {
        MemoryIo copy;
        copy.bytes = io.bytes;
        Rig after(true);
        ASSERT_TRUE(after.attach(copy, false).ok());
        EXPECT_EQ(after.hash(), committed);
    }
    io.room = ~0ull;  // room again
    ASSERT_TRUE(rig.store.commit(rig.volume, 3).ok());
    EXPECT_EQ(rig.hash(), hash);
    ASSERT_TRUE(rig.put(450, 1));
    rig.store.begin_frame({});
    EXPECT_FALSE(rig.store.counts().full || rig.store.counts().failed);
    rig.store.close();
    Rig after(true);
    ASSERT_TRUE(after.attach(io, false).ok());
    EXPECT_EQ(after.hash(), hash);
}

TEST(StoreFile, AFullIndexIsAState) {
    MemoryIo io;
    Rig rig(true, 50);
    ASSERT_TRUE(rig.attach(io, true).ok());
    int refused = 0;
    for (int i = 0; i < 200; ++i) refused += !rig.put(i, 2);
    EXPECT_EQ(refused, 200 - 50 - static_cast<int>(kPool));
    EXPECT_TRUE(rig.store.counts().full);
    EXPECT_EQ(rig.store.commit(rig.volume, 1).code(), Code::insufficient_memory);
}

TEST(StoreFile, UnreadableChunksAreReportedAndDoNotBeginAnew) {
    MemoryIo io;
    Rig rig(true);
    ASSERT_TRUE(rig.attach(io, true).ok());
    for (int i = 0; i < 400; ++i) ASSERT_TRUE(rig.put(i, 2));
    ASSERT_TRUE(rig.store.commit(rig.volume, 1).ok());
    const std::uint32_t away = rig.store.away();
    io.read_fails = true;
    int failed = 0;
    for (int i = 0; i < 400; ++i) failed += !rig.put(i, 3);
    EXPECT_GT(failed, 200);
    EXPECT_TRUE(rig.store.counts().failed);
    io.read_fails = false;
    EXPECT_GE(rig.store.away(), away);
    EXPECT_TRUE(rig.readable());
}

TEST(StoreFile, AFailedSyncIsNeverACommit) {
    MemoryIo io;
    Rig rig(true);
    ASSERT_TRUE(rig.attach(io, true).ok());
    rig.put(1, 1);
    io.sync_fails = true;
    EXPECT_EQ(rig.store.commit(rig.volume, 1).code(), Code::io);
    io.sync_fails = false;
    EXPECT_EQ(rig.store.commit(rig.volume, 1).code(), Code::io) << "what was written before may be gone";
    EXPECT_TRUE(rig.store.counts().failed);
}

// The machine dies at 200 random bytes of the history, with writes cut short.
TEST(StoreFile, DeadAtAnyByteItOpensAtTheLastCommit) {
    MemoryIo whole;
    std::vector<std::uint64_t> hashes;
    {
        Rig rig(true);
        ASSERT_TRUE(rig.attach(whole, true).ok());
        hashes = write_history(rig, 6, 7);
        rig.store.close();
    }
    Rng rng(8);
    for (int round = 0; round < 200; ++round) {
        MemoryIo io;
        Rig rig(true);
        ASSERT_TRUE(rig.attach(io, true).ok());
        io.most = 1 + static_cast<std::size_t>(rng.below(9000));
        io.life = rng.next() % (whole.bytes.size() - 2 * kStorePage);
        // What the process itself still reads comes from a page cache that has everything; only the copy
        // dies.
        struct Both final : StoreIo {
            MemoryIo alive;
            MemoryIo* dying = nullptr;
            std::int64_t read(std::uint64_t at, void* to, std::size_t n) override {
                return alive.read(at, to, n);
            }
            std::int64_t write(std::uint64_t at, const void* from, std::size_t n) override {
                const std::int64_t put = dying->write(at, from, n);
                alive.write(at, from, static_cast<std::size_t>(put));
                return put;
            }
            int sync() override { return 0; }
            std::int64_t size() override { return alive.size(); }
            int truncate(std::uint64_t n) override { return alive.truncate(n); }
        } both;
        both.alive.bytes = io.bytes;
        both.dying = &io;
        rig.store.close();
        ASSERT_TRUE(rig.attach(both, false).ok());
        ASSERT_EQ(write_history(rig, 6, 7), hashes);
        rig.store.close();
        Rig after(true);
        std::uint64_t frames = 99;
        const Status status = after.attach(io, false, &frames);
        ASSERT_TRUE(status.ok()) << status.text();
        ASSERT_LT(frames, hashes.size());
        ASSERT_EQ(after.hash(), hashes[frames]);
        ASSERT_TRUE(after.readable());
    }
}

// A writer in a process of its own, killed 200 times. It tells in shared memory which commits returned.
TEST(StoreFile, KilledAtRandomMomentsItOpensAtTheLastCommit) {
    const TempFolder folder;
    const std::string path = folder.path("store");
    struct Shared {
        std::atomic<std::uint64_t> begun, done;
        std::uint64_t hashes[100000];
    };
    auto* shared = static_cast<Shared*>(mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE,
                                             MAP_SHARED | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0));
    ASSERT_NE(shared, MAP_FAILED);
    {
        Rig rig(true);
        ASSERT_TRUE(rig.store.create(path.c_str(), {}).ok());
        shared->hashes[0] = rig.hash();
    }
    Rng rng(9);
    std::uint64_t last = 0, all = 0;  // commits
    for (int round = 0; round < 200; ++round) {
        const pid_t child = fork();
        ASSERT_GE(child, 0);
        if (child == 0) {
            Rig rig(true);
            std::uint64_t frames = 0;
            if (!rig.store.resume(path.c_str(), &frames).ok()) _exit(1);
            Rng steps(static_cast<std::uint64_t>(round));
            for (std::uint64_t c = frames + 1;; ++c) {
                for (int i = 0; i < 50; ++i)
                    if (!rig.put(steps.below(150), steps.below(100))) _exit(2);
                shared->hashes[c % 100000] = rig.hash();
                shared->begun.store(c);
                if (!rig.store.commit(rig.volume, c).ok()) _exit(3);
                shared->done.store(c);
            }
        }
        std::this_thread::sleep_for(std::chrono::microseconds(rng.below(25000)));
        kill(child, SIGKILL);
        int result = 0;
        ASSERT_EQ(waitpid(child, &result, 0), child);
        ASSERT_TRUE(WIFSIGNALED(result))
            << "round " << round << ": the writer ended with " << WEXITSTATUS(result);
        Rig after(true);
        std::uint64_t frames = 0;
        const Status status = after.store.resume(path.c_str(), &frames);
        ASSERT_TRUE(status.ok()) << "round " << round << ": " << status.text();
        ASSERT_GE(frames, std::max(last, shared->done.load())) << "a commit that returned is gone";
        ASSERT_LE(frames, std::max(last, shared->begun.load()));
        ASSERT_EQ(after.hash(), shared->hashes[frames % 100000]);
        ASSERT_TRUE(after.readable());
        last = frames;
        if (fs::file_size(path) < (64u << 20)) continue;
        after.store.close();  // a new one, to keep the test small
        fs::remove(path);
        ASSERT_TRUE(after.store.create(path.c_str(), {}).ok());
        all += last;
        last = 0;
        shared->begun.store(0);
        shared->done.store(0);
        shared->hashes[0] = Rig(true).hash();
    }
    // One in ten lives is enough to say so; on a loaded machine most end before their first commit.
    EXPECT_GT(all + last, 20u) << "hardly a commit was made";
    munmap(shared, sizeof(Shared));
}

TEST(StoreFile, PathsThatCannotBeAndFilesInUse) {
    const TempFolder folder;
    Rig rig(true), second(true);
    std::uint64_t frames = 0;
    EXPECT_EQ(rig.store.resume(folder.path("none").c_str(), &frames).code(), Code::io);
    EXPECT_EQ(rig.store.resume(folder.path().c_str(), &frames).code(), Code::io);
    EXPECT_EQ(rig.store.create(folder.path("none/store").c_str(), {}).code(), Code::io);
    std::ofstream(folder.path("text")) << std::string(9000, 'x');
    EXPECT_EQ(rig.store.resume(folder.path("text").c_str(), &frames).code(), Code::format);
    EXPECT_EQ(rig.store.create(folder.path("text").c_str(), {}).code(), Code::io) << "it exists";
    ASSERT_TRUE(rig.store.create(folder.path("store").c_str(), {}).ok());
    EXPECT_EQ(second.store.resume(folder.path("store").c_str(), &frames).code(), Code::io) << "in use";
    rig.store.close();
    EXPECT_TRUE(second.store.resume(folder.path("store").c_str(), &frames).ok());
    EXPECT_FALSE(fs::exists(folder.path("store.part")));
}

// Through the C interface, on a disk of 2 MiB.
TEST(StoreFile, FusionGoesOnWhenTheDiskIsFull) {
    const TempFolder folder;
    const std::string disk = folder.path("disk");
    fs::create_directory(disk);
    if (::mount("burin-test", disk.c_str(), "tmpfs", 0, "size=2m") != 0)
        GTEST_SKIP() << "SKIPPED: no right to mount a small tmpfs";
    {
        burin_config config = test_config(0.01f);
        config.budget_bytes = 5u << 20;
        config.store_chunks = 20000;
        const ApiMap map(config);
        ASSERT_EQ(burin_store_open(map.map, (disk + "/store").c_str(), BURIN_STORE_NEW), BURIN_OK)
            << burin_last_error(map.map);
        std::uint32_t flags = 0, fused = 0;
        for (int i = 0; i < 30; ++i) {
            const Camera camera = test_camera();
            const Se3 T = look_from({0, 0, 0}, {std::sin(i * 0.2), 0, std::cos(i * 0.2)});
            const Image<float> depth =
                AnalyticScene{{}, {{{0, 0, 6}, 4.5}, {{6, 0, 0}, 4}, {{0, 0, -6}, 4.5}}}.depth(camera, T);
            const burin_frame frame = c_frame(frame_of(depth, camera, T));
            burin_frame_result result;
            ASSERT_EQ(burin_integrate(map.map, &frame, &result), BURIN_OK) << burin_last_error(map.map);
            flags |= result.flags;
            fused += result.chunks_fused;
        }
        EXPECT_EQ(flags & (BURIN_FLAG_POOL_FULL | BURIN_FLAG_STORE_FULL | BURIN_FLAG_STORE_FAILED),
                  BURIN_FLAG_POOL_FULL | BURIN_FLAG_STORE_FULL);
        EXPECT_GT(fused, 1000u);
        EXPECT_EQ(map.stats().store_error, ENOSPC);
        EXPECT_EQ(burin_store_commit(map.map), BURIN_IO);
        EXPECT_NE(std::string(burin_last_error(map.map)).find("No space left"), std::string::npos);
    }
    {
        burin_config config = test_config(0.01f);
        config.store_chunks = 20000;
        const ApiMap map(config);
        EXPECT_EQ(burin_store_open(map.map, (disk + "/store").c_str(), BURIN_STORE_RESUME), BURIN_OK)
            << burin_last_error(map.map);
        EXPECT_EQ(map.stats().frames, 0u) << "nothing was committed";
    }
    EXPECT_EQ(::umount(disk.c_str()), 0);
}

// What a reader was asked for comes whole, in whatever order it is taken; what is passed over is given up.
TEST(ChunkReader, GivesWhatItWasAskedForAndNothingElse) {
    constexpr std::size_t kBytes = 2048;
    MemoryIo io;
    io.bytes.resize(kBytes * 100);
    for (std::size_t i = 0; i < io.bytes.size(); ++i)
        io.bytes[i] = static_cast<unsigned char>(i / kBytes + i % 7);
    Arena measure;
    ChunkReader reader;
    reader.place(measure, kBytes);
    const Memory memory = aligned_memory(measure.used());
    Arena arena(memory.get(), measure.used());
    reader.place(arena, kBytes);
    ASSERT_TRUE(reader.start().ok());
    reader.open(&io);
    const auto right = [&](const void* got, std::uint64_t chunk) {
        return got && std::memcmp(got, &io.bytes[chunk * kBytes], kBytes) == 0;
    };
    EXPECT_EQ(reader.take(0), nullptr) << "nobody asked";
    Rng rng(5);
    for (int round = 0; round < 300; ++round) {
        std::vector<std::uint64_t> chunks;
        for (int i = 1 + rng.below(80); i > 0; --i) {
            const auto chunk = static_cast<std::uint64_t>(rng.below(100));
            if (!reader.ask(chunk * kBytes))
                break;  // a full ring, or one that the last round's reads still fill
            chunks.push_back(chunk);
        }
        ASSERT_LT(chunks.size(), 32u) << "a ring of 32 pages, one of them in use";
        for (const std::uint64_t chunk : chunks)
            if (rng.below(4) != 0) {  // else it is passed over
                ASSERT_TRUE(right(reader.take(chunk * kBytes), chunk));
            }
        if (round % 3 == 0) {
            reader.give_up();
            ASSERT_EQ(reader.take(chunks.empty() ? 0 : chunks.back() * kBytes), nullptr);
        }
    }
    reader.give_up();
    while (!reader.ask(3 * kBytes)) reader.give_up();
    io.read_fails = true;
    while (!reader.ask(4 * kBytes)) reader.give_up();
    EXPECT_EQ(reader.take(4 * kBytes), nullptr) << "it could not be read";
    io.read_fails = false;
    while (!reader.ask(99 * kBytes)) reader.give_up();
    EXPECT_TRUE(right(reader.take(99 * kBytes), 99));
    reader.close();
    reader.open(&io);
    EXPECT_EQ(reader.take(99 * kBytes), nullptr) << "closed in between";
}

}  // namespace
}  // namespace burin
