// SPDX-License-Identifier: MIT
// The file under the store: it opens at its last commit whatever happened to its writer, and a full disk is a
// state.
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "dataset_files.h"
#include "emulated.h"
#include "scene_helpers.h"
#include "unit/store_rig.h"

namespace burin {
namespace {

namespace fs = std::filesystem;

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
    for (std::size_t length = 0; length <= io.bytes.size(); length += length < ends[3] ? 509 : sized(1, 97)) {
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
        std::size_t older = 0, in_mark = 0;
        for (std::size_t at = 0; at < io.bytes.size(); at += sized(1, 97)) {
            MemoryIo changed;
            changed.bytes = io.bytes;
            changed.bytes[at] = static_cast<unsigned char>(changed.bytes[at] ^ 1 << rng.below(8));
            std::uint64_t frames = 0;
            const Status status = again.attach(changed, false, &frames);
            // A damaged last mark cannot be told from one that was never finished: the commit before holds.
            const bool in_last_mark = at >= io.bytes.size() - kStorePage;
            ASSERT_EQ(status.ok(), in_last_mark) << at << ": " << status.text();
            in_mark += in_last_mark;
            older += status.ok() && frames == 1;
            ASSERT_TRUE(status.ok() || status.code() == Code::format || status.code() == Code::unsupported);
            again.store.close();
        }
        EXPECT_EQ(older, in_mark);
        EXPECT_GE(in_mark, kStorePage / sized(1, 97));
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

// Offsets have 64 bits on machines of 32 bits too. The file is sparse.
TEST(StoreFile, GoesOnBeyondFourGiB) {
    const TempFolder folder;
    FileIo file;
    ASSERT_TRUE(file.create(folder.path("store").c_str()).ok());
    constexpr std::uint64_t kFar = 5ull << 30;
    ASSERT_EQ(write_all(file, 0, "near", 4), 0);
    ASSERT_EQ(write_all(file, kFar, "far!", 4), 0);
    EXPECT_EQ(file.size(), static_cast<std::int64_t>(kFar + 4));
    char got[5] = "";
    ASSERT_EQ(read_all(file, 0, got, 4), 0);
    EXPECT_STREQ(got, "near");
    ASSERT_EQ(read_all(file, kFar, got, 4), 0);
    EXPECT_STREQ(got, "far!");
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
