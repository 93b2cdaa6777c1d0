// SPDX-License-Identifier: MIT
// A short sequence looped for very long in a 64 MiB budget, with all an application asks for: resident memory
// must be flat after the first minute, and the map must go on as it began.
//     BURIN_SOAK_FRAMES=100000 build/release/tests/soak/test_soak
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>

#include "datasets/synthetic/synth.h"
#include "scene_helpers.h"

namespace burin {
namespace {

constexpr int kLoop = 24;              // frames rendered once
constexpr long kReport = 1000;         // frames from one line to the next
constexpr double kSettleSeconds = 60;  // until then pages of the arena may be touched for the first time
constexpr long kAllowedBytes =
    65536;  // the kernel maps 16 pages of a library at a time; a byte a frame is found

long resident_bytes() {
    long all = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> all >> resident;
    return resident * sysconf(_SC_PAGESIZE);
}

TEST(Soak, ResidentMemoryIsFlat) {
    const char* wanted = std::getenv("BURIN_SOAK_FRAMES");
    if (!wanted) GTEST_SKIP() << "SKIPPED: set BURIN_SOAK_FRAMES, 100000 for the real run";
    const long frames = std::atol(wanted);
    ASSERT_GT(frames, 3 * kReport) << "BURIN_SOAK_FRAMES is '" << wanted << "', expected more than "
                                   << 3 * kReport;

    SynthOptions options;
    options.frames = kLoop;
    options.width = 320;  // the full size would take hours and test nothing more
    options.height = 240;
    const auto dataset = SyntheticDataset::create(options);
    ASSERT_TRUE(dataset.ok()) << dataset.status().text();
    std::vector<Frame> loop(kLoop);
    for (int i = 0; i < kLoop; ++i) ASSERT_TRUE((*dataset)->load(i, &loop[static_cast<std::size_t>(i)]).ok());

    burin_config config = burin_config_default();
    config.budget_bytes = 64u << 20;
    config.voxel_m = 0.02f;  // 100,000 frames then take a quarter of an hour
    config.max_width = 320;
    config.max_height = 240;
    config.threads = 2;
    const ApiMap map(config);
    std::vector<float> positions(3 * 1944), normals(3 * 1944), depth(320 * 240);
    std::vector<std::uint8_t> colours(3 * 1944);
    std::vector<std::uint32_t> triangles(3 * 2560);
    std::vector<burin_chunk_key> keys(map.stats().chunks_capacity);

    const auto start = std::chrono::steady_clock::now();
    const auto seconds = [&] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    long baseline = 0, highest = 0;
    std::uint64_t dropped = 0;
    std::printf("%8s %8s %10s %10s %8s %10s\n", "frame", "s", "RSS KiB", "growth", "chunks", "dropped");
    for (long i = 1; i <= frames; ++i) {
        const burin_frame frame = c_frame(view_of(loop[static_cast<std::size_t>(i % kLoop)]));
        burin_frame_result result;
        ASSERT_EQ(burin_integrate(map.map, &frame, &result), BURIN_OK) << burin_last_error(map.map);
        dropped += result.chunks_dropped;
        if (i % 10 == 0) {
            std::uint64_t count = 0;
            ASSERT_EQ(burin_dirty_chunks(map.map, keys.data(), keys.size(), &count), BURIN_OK);
            burin_mesh_buffers mesh{
                1944, 2560, positions.data(), normals.data(), colours.data(), triangles.data(), 0, 0};
            for (std::uint64_t k = 0; k < count; ++k)
                ASSERT_EQ(burin_chunk_mesh(map.map, keys[k], nullptr, &mesh), BURIN_OK);
        }
        if (i % 100 == 0) {
            std::uint64_t vertices = 0, faces = 0;
            ASSERT_EQ(burin_mesh_size(map.map, nullptr, &vertices, &faces), BURIN_OK);
            ASSERT_EQ(burin_raycast(map.map, &frame.depth_camera, &frame.T_world_camera, depth.data(),
                                    nullptr, nullptr),
                      BURIN_OK);
            ASSERT_GT(faces, 10000u);
        }
        if (i % kReport != 0) continue;
        const long now = resident_bytes();
        if (i <= 2 * kReport || seconds() < kSettleSeconds) baseline = now;
        highest = std::max(highest, now - baseline);
        const burin_statistics stats = map.stats();
        ASSERT_EQ(stats.frames, static_cast<std::uint64_t>(i));
        ASSERT_EQ(stats.chunks_dropped, dropped);
        std::printf("%8ld %8.0f %10ld %10ld %8u %10llu\n", i, seconds(), now / 1024, (now - baseline) / 1024,
                    stats.chunks_live, static_cast<unsigned long long>(dropped));
        std::fflush(stdout);
    }
    EXPECT_LE(highest, kAllowedBytes) << "resident memory grew after the first minute";
}

}  // namespace
}  // namespace burin
