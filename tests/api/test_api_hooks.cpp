// SPDX-License-Identifier: MIT
// Callbacks: progress and cancelling, the application's own threads, saving and loading through functions,
// the log.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "api_checks.h"
#include "scene_helpers.h"

namespace burin {
namespace {

struct Bytes {
    std::vector<std::uint8_t> all;
    std::size_t at = 0, fail_at = ~std::size_t{0};

    static int write(void* user, const void* data, std::uint64_t bytes) {
        auto& b = *static_cast<Bytes*>(user);
        if (b.all.size() + bytes > b.fail_at) return 28;
        b.all.insert(b.all.end(), static_cast<const std::uint8_t*>(data),
                     static_cast<const std::uint8_t*>(data) + bytes);
        return 0;
    }
    static int read(void* user, void* data, std::uint64_t bytes) {
        auto& b = *static_cast<Bytes*>(user);
        if (b.at + bytes > std::min(b.fail_at, b.all.size())) return 5;
        std::copy_n(b.all.data() + b.at, bytes, static_cast<std::uint8_t*>(data));
        b.at += bytes;
        return 0;
    }
};

class Hooks : public testing::Test {
  protected:
    Hooks() : depth_(ball_and_wall().depth(camera_, arc_pose(0, 3))), colour_(160, 120, 3, 90) {
        frame_ = c_frame(frame_of(depth_, camera_, arc_pose(0, 3)));
        frame_.colour = colour_.pixels.data();
        frame_.colour_stride_bytes = 480;
        frame_.colour_camera = c_camera(camera_);
    }
    void fuse(const ApiMap& map) const {
        for (int i = 0; i < 2; ++i)
            ASSERT_EQ(burin_integrate(map.map, &frame_, nullptr), BURIN_OK) << burin_last_error(map.map);
    }
    static burin_config config_with(std::uint32_t threads) {
        burin_config config = test_config();
        config.threads = threads;
        return config;
    }

    const Camera camera_ = test_camera();
    Image<float> depth_;
    Image<std::uint8_t> colour_;
    burin_frame frame_;
};

// Everything that can be watched, with its results.
struct LongCalls {
    explicit LongCalls(const burin_frame& f) : frame(f), positions(3 * 60000), triangles(3 * 120000) {
        for (int i = 0; i < 5000; ++i)
            for (const double x : {0.001 * (i % 70), 0.01 * (i / 70), 1.9}) points.push_back(x);
    }
    std::vector<std::function<burin_status(burin_map)>> all() {
        return {
            [this](burin_map m) {
                const burin_mesh_options options = other_options();
                return burin_mesh_size(m, &options, &vertices, &count);
            },
            [this](burin_map m) {
                burin_mesh_buffers mesh{60000, 120000, positions.data(), nullptr, nullptr, triangles.data(),
                                        0,     0};
                const burin_mesh_options options = other_options();
                return burin_mesh(m, &options, &mesh);
            },
            [this](burin_map m) {
                return burin_raycast(m, &frame.depth_camera, &frame.T_world_camera, depth.data(), nullptr,
                                     nullptr);
            },
            [this](burin_map m) { return burin_sample(m, points.data(), 5000, distances.data(), nullptr); },
            [this](burin_map m) {
                saved = {};
                return burin_save_to(m, Bytes::write, &saved);
            },
            [this](burin_map m) { return burin_save(m, saved_file.c_str()); },
        };
    }
    // Never the same twice: sizes are remembered, and what is known takes no time.
    burin_mesh_options other_options() {
        burin_mesh_options options = burin_mesh_options_default();
        options.min_weight = 0.5f + 0.001f * static_cast<float>(++asked);
        return options;
    }

    int asked = 0;
    burin_frame frame;
    std::vector<double> points;
    std::vector<float> positions, depth = std::vector<float>(160 * 120), distances = std::vector<float>(5000);
    std::vector<std::uint32_t> triangles;
    std::uint64_t vertices = 0, count = 0;
    Bytes saved;
    // A name of this process: tests run beside each other in one directory.
    const std::string saved_file = "test_api_hooks_" + std::to_string(::getpid()) + ".burin";
    ~LongCalls() { std::remove(saved_file.c_str()); }
    LongCalls(const LongCalls&) = delete;
    LongCalls& operator=(const LongCalls&) = delete;
};

struct Teller {
    burin_map map;
    int calls = 0, stop_at = -1;
    double last = -1;
    bool ordered = true, refused = true;
    std::atomic<int> inside{0};

    static int progress(void* user, double done) {
        auto& t = *static_cast<Teller*>(user);
        t.ordered = t.ordered && t.inside.fetch_add(1) == 0 && done >= t.last && done <= 1;
        t.last = done;
        std::uint64_t hash = 0;
        t.refused =
            t.refused && burin_hash(t.map, &hash) == BURIN_STATE && burin_destroy(&t.map) == BURIN_STATE;
        t.inside.fetch_sub(1);
        return t.calls++ == t.stop_at;
    }
};

// The application's threads, with the ways in which they may fail.
struct Pool {
    enum Manner { kThreads, kInTurn, kNone, kHalf, kTwice, kLate } manner = kThreads;
    std::vector<std::thread> late;
    ~Pool() { join(); }
    void join() {
        for (std::thread& t : late) t.join();
        late.clear();
    }
    static int run(void* user, std::uint32_t count, burin_job body, void* context) {
        return static_cast<Pool*>(user)->run_here(count, body, context);
    }
    int run_here(std::uint32_t count, burin_job body, void* context) {
        if (manner == kNone) return 1;
        const std::uint32_t calls = manner == kHalf ? count / 2 : manner == kTwice ? 2 * count : count;
        std::vector<std::thread> threads;
        for (std::uint32_t i = 0; i < calls; ++i) {
            if (manner == kInTurn)
                body(context, i);
            else
                threads.emplace_back(body, context, i);
        }
        for (std::thread& t : threads) manner == kLate ? late.push_back(std::move(t)) : t.join();
        return 0;
    }
};

TEST_F(Hooks, ProgressRisesToOneAndTheCallCanBeStoppedAnywhere) {
    for (const int way : {1, 3, -1, -2}) {  // threads, or a pool
        const ApiMap map(config_with(way < 0 ? 1 : static_cast<std::uint32_t>(way)));
        fuse(map);
        const std::uint64_t hash = map.hash();
        LongCalls calls(frame_);
        Teller teller{map.map};
        Pool pool;
        pool.manner = way == -1 ? Pool::kThreads : Pool::kInTurn;
        burin_hooks hooks = burin_hooks_default();
        struct Both {
            Teller* teller;
            Pool* pool;
        } both{&teller, &pool};
        hooks.user = &both;
        hooks.progress = [](void* user, double done) {
            return Teller::progress(static_cast<Both*>(user)->teller, done);
        };
        if (way < 0) {
            hooks.run = [](void* user, std::uint32_t count, burin_job body, void* context) {
                return Pool::run(static_cast<Both*>(user)->pool, count, body, context);
            };
            hooks.pool_threads = 3;
        }
        ASSERT_EQ(burin_set_hooks(map.map, &hooks), BURIN_OK) << burin_last_error(map.map);
        for (const auto& call : calls.all()) {
            teller.calls = 0, teller.last = -1, teller.stop_at = -1;
            ASSERT_EQ(call(map.map), BURIN_OK) << burin_last_error(map.map);
            EXPECT_EQ(teller.last, 1.0);
            const int reports = teller.calls - 1;
            EXPECT_GE(reports, 1);
            for (const int at : {0, reports / 3, reports / 2}) {
                teller.calls = 0, teller.last = -1, teller.stop_at = at;
                const burin_status status = call(map.map);
                if (way == 1 || at == 0) {
                    EXPECT_EQ(status, BURIN_CANCELLED) << "stopped at " << at << " of " << reports;
                }
                // With threads, the others may be done before the one that reports gets so far.
                EXPECT_TRUE(status == BURIN_CANCELLED || (status == BURIN_OK && teller.calls - 1 <= at))
                    << status;
                if (status == BURIN_CANCELLED) expect_text(map.map, "cancelled");
            }
            EXPECT_TRUE(teller.ordered);
            EXPECT_TRUE(teller.refused) << "a callback may not use its own map";
        }
        ASSERT_EQ(burin_set_hooks(map.map, nullptr), BURIN_OK);
        EXPECT_EQ(map.hash(), hash);
        for (const auto& call : calls.all()) EXPECT_EQ(call(map.map), BURIN_OK);
    }
}

TEST_F(Hooks, ACancelledCountIsNotRemembered) {
    const ApiMap map(test_config());
    fuse(map);
    std::uint64_t vertices = 0, triangles = 0, again[2] = {0, 0};
    ASSERT_EQ(burin_mesh_size(map.map, nullptr, &vertices, &triangles), BURIN_OK);
    fuse(map);  // what was counted is forgotten
    ASSERT_EQ(burin_mesh_size(map.map, nullptr, &vertices, &triangles), BURIN_OK);
    burin_mesh_options other = burin_mesh_options_default();
    other.min_weight = 0.7f;
    Teller teller{map.map};
    teller.stop_at = 0;
    burin_hooks hooks = burin_hooks_default();
    hooks.user = &teller;
    hooks.progress = Teller::progress;
    ASSERT_EQ(burin_set_hooks(map.map, &hooks), BURIN_OK);
    EXPECT_EQ(burin_mesh_size(map.map, &other, &again[0], &again[1]), BURIN_CANCELLED);
    EXPECT_EQ(again[0], 0u);
    ASSERT_EQ(burin_mesh_size(map.map, &other, &again[0], &again[1]), BURIN_OK);
    ASSERT_EQ(burin_mesh_size(map.map, nullptr, &again[0], &again[1]), BURIN_OK);
    EXPECT_EQ(again[0], vertices);
    EXPECT_EQ(again[1], triangles);
}

TEST_F(Hooks, ACancelledSaveLeavesTheFileThatWasThere) {
    const ApiMap map(test_config()), other(test_config());
    const char* path = "test_api_hooks_kept.burin";
    ASSERT_EQ(burin_save(map.map, path), BURIN_OK);
    fuse(map);
    Teller teller{map.map};
    teller.stop_at = 100;
    burin_hooks hooks = burin_hooks_default();
    hooks.user = &teller;
    hooks.progress = Teller::progress;
    ASSERT_EQ(burin_set_hooks(map.map, &hooks), BURIN_OK);
    EXPECT_EQ(burin_save(map.map, path), BURIN_CANCELLED);
    burin_file_info info;
    ASSERT_EQ(burin_file_probe(path, &info), BURIN_OK);
    EXPECT_EQ(info.chunks, 0u);
    std::remove(path);
}

TEST_F(Hooks, TheApplicationsThreadsGiveTheSameMap) {
    const ApiMap plain(test_config());
    fuse(plain);
    LongCalls wanted(frame_);
    for (const auto& call : wanted.all()) ASSERT_EQ(call(plain.map), BURIN_OK);
    for (const Pool::Manner manner :
         {Pool::kThreads, Pool::kInTurn, Pool::kNone, Pool::kHalf, Pool::kTwice, Pool::kLate})
        for (const std::uint32_t threads : {1u, 4u}) {
            Pool pool;
            pool.manner = manner;
            const ApiMap map(test_config());
            burin_hooks hooks = burin_hooks_default();
            hooks.user = &pool;
            hooks.run = Pool::run;
            hooks.pool_threads = threads;
            ASSERT_EQ(burin_set_hooks(map.map, &hooks), BURIN_OK);
            fuse(map);
            EXPECT_EQ(map.hash(), plain.hash()) << "manner " << manner;
            LongCalls got(frame_);
            for (const auto& call : got.all()) ASSERT_EQ(call(map.map), BURIN_OK);
            EXPECT_EQ(got.positions, wanted.positions);
            EXPECT_EQ(got.triangles, wanted.triangles);
            EXPECT_EQ(got.depth, wanted.depth);
            EXPECT_EQ(got.saved.all, wanted.saved.all);
            pool.join();  // before the map goes
        }
}

TEST_F(Hooks, BadHooksAreRefusedAndTheOldOnesStay) {
    const ApiMap map(test_config());
    Teller teller{map.map};
    burin_hooks good = burin_hooks_default();
    good.user = &teller;
    good.progress = Teller::progress;
    ASSERT_EQ(burin_set_hooks(map.map, &good), BURIN_OK);
    const std::pair<const char*, std::function<void(burin_hooks&)>> cases[] = {
        {"size", [](burin_hooks& h) { h.struct_size -= 8; }},
        {"size", [](burin_hooks& h) { h.struct_size += 8; }},
        {"pool_threads", [](burin_hooks& h) { h.pool_threads = 0; }},
        {"pool_threads", [](burin_hooks& h) { h.pool_threads = 65; }},
        {"reserved", [](burin_hooks& h) { h.reserved[7] = 1; }},
    };
    for (const auto& [part, spoil] : cases) {
        burin_hooks bad = burin_hooks_default();
        spoil(bad);
        EXPECT_EQ(burin_set_hooks(map.map, &bad), BURIN_INVALID_ARGUMENT);
        expect_text(map.map, part);
    }
    EXPECT_EQ(burin_set_hooks(kNull, &good), BURIN_STATE);
    fuse(map);
    std::uint64_t a, b;
    EXPECT_EQ(burin_mesh_size(map.map, nullptr, &a, &b), BURIN_OK);
    EXPECT_GT(teller.calls, 1);
}

TEST_F(Hooks, SavingAndLoadingThroughFunctions) {
    const ApiMap map(test_config());
    fuse(map);
    Bytes bytes;
    ASSERT_EQ(burin_save_to(map.map, Bytes::write, &bytes), BURIN_OK) << burin_last_error(map.map);
    const char* path = "test_api_hooks_same.burin";
    ASSERT_EQ(burin_save(map.map, path), BURIN_OK);
    std::vector<std::uint8_t> file(bytes.all.size() + 1);
    std::FILE* f = std::fopen(path, "rb");
    ASSERT_NE(f, nullptr);
    file.resize(std::fread(file.data(), 1, file.size(), f));
    std::fclose(f);
    std::remove(path);
    EXPECT_EQ(file, bytes.all);

    burin_file_info info{};
    ASSERT_EQ(burin_probe_from(Bytes::read, &bytes, &info), BURIN_OK);
    EXPECT_EQ(bytes.at, 4096u);
    EXPECT_EQ(info.hash, map.hash());
    EXPECT_EQ(info.frames, 2u);

    const ApiMap other(test_config());
    bytes.all.resize(bytes.all.size() + 100, 0xcc);  // something else in the same stream
    bytes.at = 0;
    ASSERT_EQ(burin_load_from(other.map, Bytes::read, &bytes), BURIN_OK) << burin_last_error(other.map);
    EXPECT_EQ(bytes.at + 100, bytes.all.size());
    EXPECT_EQ(other.hash(), map.hash());
    EXPECT_EQ(other.stats().frames, 2u);
}

TEST_F(Hooks, CallbacksThatFail) {
    const ApiMap map(test_config());
    fuse(map);
    const std::uint64_t hash = map.hash();
    Bytes whole;
    ASSERT_EQ(burin_save_to(map.map, Bytes::write, &whole), BURIN_OK);
    for (const std::size_t at :
         {std::size_t{0}, std::size_t{4096}, std::size_t{9000}, whole.all.size() - 1}) {
        Bytes out;
        out.fail_at = at;
        EXPECT_EQ(burin_save_to(map.map, Bytes::write, &out), BURIN_IO);
        expect_text(map.map, "write callback failed with 28");
        EXPECT_EQ(map.hash(), hash);
        const ApiMap other(test_config());
        fuse(other);
        Bytes in = whole;
        in.fail_at = at;
        EXPECT_EQ(burin_load_from(other.map, Bytes::read, &in), BURIN_IO);
        expect_text(other.map, "read callback failed with 5");
        EXPECT_EQ(other.stats().chunks_live, at == 0 ? map.stats().chunks_live : 0) << "empty, or as it was";
    }
    // Damage, and a map that was cut short and continued by something else.
    const ApiMap other(test_config());
    for (const std::size_t at : {std::size_t{3}, std::size_t{100}, std::size_t{4100}, whole.all.size() - 1}) {
        Bytes in = whole;
        in.all[at] ^= 1;
        EXPECT_EQ(burin_load_from(other.map, Bytes::read, &in), BURIN_FORMAT) << at;
        EXPECT_EQ(other.stats().chunks_live, 0u);
    }
    burin_file_info info{};
    info.chunks = 77;
    Bytes nothing;
    EXPECT_EQ(burin_probe_from(Bytes::read, &nothing, &info), BURIN_IO);
    EXPECT_EQ(burin_probe_from(nullptr, nullptr, &info), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_probe_from(Bytes::read, &whole, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(info.chunks, 77u);
    EXPECT_EQ(burin_save_to(map.map, nullptr, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_load_from(map.map, nullptr, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_save_to(kNull, Bytes::write, &nothing), BURIN_STATE);
    EXPECT_EQ(burin_load_from(kNull, Bytes::read, &nothing), BURIN_STATE);
    EXPECT_EQ(map.hash(), hash);
}

TEST_F(Hooks, ACancelledLoadLeavesAnEmptyMap) {
    const ApiMap map(test_config());
    fuse(map);
    Bytes whole;
    ASSERT_EQ(burin_save_to(map.map, Bytes::write, &whole), BURIN_OK);
    Teller teller{map.map};
    teller.stop_at = 50;
    burin_hooks hooks = burin_hooks_default();
    hooks.user = &teller;
    hooks.progress = Teller::progress;
    ASSERT_EQ(burin_set_hooks(map.map, &hooks), BURIN_OK);
    EXPECT_EQ(burin_load_from(map.map, Bytes::read, &whole), BURIN_CANCELLED);
    EXPECT_EQ(map.stats().chunks_live, 0u);
    EXPECT_EQ(map.stats().frames, 0u);
}

struct Lines {
    std::vector<std::pair<burin_log_level, std::string>> all;
    burin_map map = kNull;
    static void log(void* user, burin_log_level level, const char* line) {
        auto& l = *static_cast<Lines*>(user);
        l.all.emplace_back(level, line);
        burin_integrate(l.map, nullptr, nullptr);  // fails; is not logged again
    }
};

TEST_F(Hooks, Log) {
    Lines lines;
    burin_set_log(Lines::log, &lines);
    {
        burin_config config = test_config();
        config.budget_bytes = (1u << 20) + (16u << 10);
        const ApiMap map(config);
        lines.map = map.map;
        ASSERT_EQ(lines.all.size(), 1u);
        EXPECT_EQ(lines.all[0].first, BURIN_LOG_INFO);
        EXPECT_NE(lines.all[0].second.find("chunks in"), std::string::npos);
        lines.all.clear();
        fuse(map);
        ASSERT_EQ(lines.all.size(), 1u) << "a full map is told once";
        EXPECT_EQ(lines.all[0].first, BURIN_LOG_WARNING);
        EXPECT_NE(lines.all[0].second.find("budget_bytes"), std::string::npos);
        lines.all.clear();
        burin_frame bad = frame_;
        bad.depth = nullptr;
        EXPECT_EQ(burin_integrate(map.map, &bad, nullptr), BURIN_INVALID_ARGUMENT);
        ASSERT_EQ(lines.all.size(), 1u);
        EXPECT_EQ(lines.all[0].first, BURIN_LOG_ERROR);
        EXPECT_NE(lines.all[0].second.find("depth is null"), std::string::npos);
    }
    burin_set_log(nullptr, nullptr);
    burin_integrate(kNull, nullptr, nullptr);
    EXPECT_EQ(lines.all.size(), 1u);
}

}  // namespace
}  // namespace burin
