// SPDX-License-Identifier: MIT
// The same bytes everywhere (design, promise 3): maps and meshes of fixed input have the hashes in
// hashes.json, for any number of threads, any kernels and any machine. After a change that is meant to alter
// them, write them anew with
//     BURIN_GOLDEN_WRITE=1 ctest --test-dir build/release -L golden
// and look at the difference; say in the commit why it changed.
#include <gtest/gtest.h>

#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "core/hash.h"
#include "data_dir.h"
#include "datasets/open.h"
#include "datasets/synthetic/synth.h"
#include "scene_helpers.h"
#include "simd/targets.h"

namespace burin {
namespace {

const std::string kFile = std::string(BURIN_SOURCE_DIR) + "/tests/golden/hashes.json";

// Under emulation, where floating point is a hundred times slower, recorded sequences go through the best
// kernels alone; the rendered ones go through all.
#if defined(BURIN_EMULATED) && defined(BURIN_GOLDEN_RECORDED)
constexpr bool kBestKernelsOnly = true;
#else
constexpr bool kBestKernelsOnly = false;
#endif

std::string hex(std::uint64_t value) {
    char text[17];
    std::snprintf(text, sizeof text, "%016" PRIx64, value);
    return text;
}

nlohmann::json stored() {
    std::ifstream file(kFile);
    return file ? nlohmann::json::parse(file, nullptr, false) : nlohmann::json::object();
}

// Compares, or stores when told to.
void check(const std::string& name, const std::string& value) {
    nlohmann::json all = stored();
    ASSERT_TRUE(all.is_object()) << kFile << " is no JSON object";
    if (std::getenv("BURIN_GOLDEN_WRITE")) {
        all[name] = value;
        std::ofstream(kFile) << all.dump(2) << '\n';
        return;
    }
    ASSERT_TRUE(all.contains(name)) << kFile << " has no '" << name << "'; see the head of this file";
    EXPECT_EQ(all[name].get<std::string>(), value) << name;
}

std::uint64_t mesh_hash(const TriangleMesh& m) {
    std::uint64_t h = hash_bytes(m.positions.data(), m.positions.size() * sizeof m.positions[0]);
    h = hash_bytes(m.normals.data(), m.normals.size() * sizeof m.normals[0], h);
    h = hash_bytes(m.colours.data(), m.colours.size() * sizeof m.colours[0], h);
    return hash_bytes(m.triangles.data(), m.triangles.size() * sizeof m.triangles[0], h);
}

// The equations of the planes that are told, their ids, labels and areas.
std::uint64_t planes_hash(const PlaneLayer& layer) {
    std::uint64_t h = 0;
    for (std::uint32_t i = 0; i < layer.set().used(); ++i) {
        const GlobalPlane& p = layer.set().at(i);
        if (!layer.told(p)) continue;
        const double values[] = {p.normal.x, p.normal.y, p.normal.z, p.offset, p.area_m2, p.seen_area_m2};
        const std::uint32_t numbers[] = {p.id, p.patches, p.label};
        h = hash_bytes(numbers, sizeof numbers, hash_bytes(values, sizeof values, h));
    }
    return h;
}

// Gives frame i; what it points to need live only until the next one.
using FrameAt = std::function<void(int i, Frame* frame)>;

// Fuses `count` frames with each kind of kernel and several numbers of threads; every run must be as stored.
// The runs go side by side, so that each frame is read once: under emulation the decoding takes longer than
// the fusion.
void check_sequence(const std::string& name, int count, const FrameAt& frame_at, burin_config config) {
    struct Run {
        std::string target;
        std::uint32_t threads;
        std::unique_ptr<TestSession> session;
    };
    std::vector<Run> runs;
    for (const std::string& target : simd::target_names()) runs.push_back({target, 2, nullptr});
    if (kBestKernelsOnly) {
        runs.resize(1);
    } else {
        runs.push_back({simd::target_names().front(), 1, nullptr});
    }
    Frame frame;
    for (int i = 0; i < count; ++i) {
        frame_at(i, &frame);
        if (testing::Test::HasFatalFailure()) return;
        for (Run& run : runs) {
            ASSERT_TRUE(simd::select_target(run.target));
            if (!run.session) {
                config.max_width = static_cast<std::uint32_t>(frame.depth_camera.width);
                config.max_height = static_cast<std::uint32_t>(frame.depth_camera.height);
                config.threads = run.threads;
                run.session = std::make_unique<TestSession>(config);
            }
            FrameReport report;
            if (config.tracker == BURIN_TRACKER_NONE) {
                report = run.session->integrate(view_of(frame));
            } else {
                const ScanReport scanned = run.session->session.scan(view_of(frame), run.session->jobs);
                ASSERT_EQ(scanned.tracking.state, TrackingState::tracking) << i;
                report = scanned.fusion;
            }
            ASSERT_EQ(report.chunks.dropped, 0u) << "the budget of this test is too small";
        }
    }
    std::string map, mesh, planes;
    for (Run& run : runs) {
        ASSERT_TRUE(simd::select_target(run.target));
        if (config.planes) run.session->session.refresh_planes(run.session->jobs);
        const std::string got_planes = hex(planes_hash(run.session->session.planes()));
        const std::string got_map = hex(run.session->session.hash()),
                          got_mesh = hex(mesh_hash(run.session->mesh({})));
        if (map.empty()) {
            map = got_map;
            mesh = got_mesh;
            planes = got_planes;
        }
        EXPECT_EQ(got_planes, planes)
            << name << " on " << run.target << " with " << run.threads << " threads";
        EXPECT_EQ(got_map, map) << name << " on " << run.target << " with " << run.threads << " threads";
        EXPECT_EQ(got_mesh, mesh) << name << " on " << run.target << " with " << run.threads << " threads";
        std::printf("%s: %s, %u threads: map %s\n", name.c_str(), run.target.c_str(), run.threads,
                    got_map.c_str());
        run.session.reset();
    }
    ASSERT_TRUE(simd::select_target(""));
    check(name + ", map", map);
    check(name + ", mesh", mesh);
    if (config.planes) check(name + ", planes", planes);
}

#ifndef BURIN_GOLDEN_RECORDED

void check_sequence(const std::string& name, const std::vector<Frame>& frames, burin_config config) {
    const auto frame_at = [&frames](int i, Frame* frame) { *frame = frames[static_cast<std::size_t>(i)]; };
    check_sequence(name, static_cast<int>(frames.size()), frame_at, config);
}

const std::vector<Frame>& rendered(const std::string& scene, int count) {
    static std::map<std::string, std::vector<Frame>> scenes;
    std::vector<Frame>& frames = scenes[scene];
    if (!frames.empty()) return frames;
    SynthOptions options;
    options.scene = scene;
    options.frames = count;
    options.width = 320;
    options.height = 240;
    const auto dataset = SyntheticDataset::create(options);
    EXPECT_TRUE(dataset.ok()) << dataset.status().text();
    frames.resize(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i)
        EXPECT_TRUE((*dataset)->load(i, &frames[static_cast<std::size_t>(i)]).ok());
    return frames;
}

// The input itself: when this differs, the rendering is to blame and not the fusion.
std::string input_hash(const std::vector<Frame>& frames) {
    std::uint64_t h = 0;
    for (const Frame& f : frames) {
        h = hash_bytes(f.depth_f32.pixels.data(), 4 * f.depth_f32.pixels.size(), h);
        h = hash_bytes(f.depth_u16.pixels.data(), 2 * f.depth_u16.pixels.size(), h);
        h = hash_bytes(f.colour.pixels.data(), f.colour.pixels.size(), h);
        h = hash_bytes(&f.T_world_camera, sizeof f.T_world_camera, h);
    }
    return hex(h);
}

burin_config config_of(float voxel_m) {
    burin_config c = burin_config_default();
    c.voxel_m = voxel_m;
    c.budget_bytes = 128u << 20;
    return c;
}

TEST(Golden, Room) {
    const std::vector<Frame>& frames = rendered("room", 8);
    check("room 320x240 8 frames, input", input_hash(frames));
    check_sequence("room 320x240 8 frames 15 mm", frames, config_of(0.015f));
}

// The map is that of Golden.Room, the mesh is drawn to the planes.
TEST(Golden, RoomWithPlanes) {
    burin_config config = config_of(0.015f);
    config.planes = 1;
    check_sequence("room 320x240 8 frames 15 mm, with planes", rendered("room", 8), config);
    const nlohmann::json all = stored();
    EXPECT_EQ(all["room 320x240 8 frames 15 mm, map"], all["room 320x240 8 frames 15 mm, with planes, map"]);
    EXPECT_NE(all["room 320x240 8 frames 15 mm, mesh"],
              all["room 320x240 8 frames 15 mm, with planes, mesh"]);
}

// Frames are fused where they were tracked to be: equal maps are equal poses, to the last bit.
TEST(Golden, RoomScanned) {
    burin_config config = burin_scan_config_default();
    config.voxel_m = 0.015f;
    config.budget_bytes = 128u << 20;
    check_sequence("room 320x240 8 frames 15 mm, scanned", rendered("room", 8), config);
}

TEST(Golden, RoomWithEveryOption) {
    burin_config config = config_of(0.015f);
    config.truncation = BURIN_TRUNCATION_QUADRATIC;
    config.weight = BURIN_WEIGHT_INVERSE_Z2;
    config.drop = BURIN_DROP_EXPONENTIAL;
    config.angle_weight = config.bilateral = config.edge_removal = 1;
    config.max_weight = 3;
    check_sequence("room 320x240 8 frames 15 mm, every option", rendered("room", 8), config);
}

TEST(Golden, Desk) {
    const std::vector<Frame>& frames = rendered("desk", 8);
    check("desk 320x240 8 frames, input", input_hash(frames));
    check_sequence("desk 320x240 8 frames 10 mm", frames, config_of(0.01f));
}

TEST(Golden, ArithmeticOnly) {
    // No rendering: integers, so that a failure here is the runtime's alone.
    Rng rng(90);
    std::vector<Frame> frames(4);
    for (Frame& f : frames) {
        f.depth_u16 = Image<std::uint16_t>(200, 150);
        for (int y = 0; y < 150; ++y)
            for (int x = 0; x < 200; ++x)
                f.depth_u16.view().at(x, y) = static_cast<std::uint16_t>(
                    1200 + 3 * x + 2 * y + ((x / 40 + y / 30) % 2) * 400 + rng.below(30));
        f.colour = Image<std::uint8_t>(100, 80, 3);
        for (std::uint8_t& c : f.colour.pixels) c = static_cast<std::uint8_t>(rng.below(256));
        f.depth_camera = {200, 150, 170, 168, 99, 74};
        f.colour_camera = {100, 80, 90, 91, 50, 40, 0.1, -0.05, 0.001, 0.002, 0.01};
        f.T_colour_depth.t = {0.05, 0, 0.01};
        const double step = static_cast<double>(&f - frames.data());
        f.T_world_camera = {{{0.8, 0, 0.6, 0, 1, 0, -0.6, 0, 0.8}},
                            {0.05 * step, -0.025 * step, 0.0125 * step}};
    }
    check_sequence("200x150 4 frames of integers 20 mm", frames, config_of(0.02f));
}

#else

void check_recorded(const std::string& path, const std::string& name, int count, burin_config config) {
    const auto dataset = open_dataset(path, "");
    ASSERT_TRUE(dataset.ok()) << dataset.status().text();
    int next = 0;
    const auto frame_at = [&dataset, &next](int, Frame* frame) {
        do {  // the trajectory has gaps
            const Status status = (*dataset)->load(next++, frame);
            ASSERT_TRUE(status.ok()) << status.text();
        } while (!frame->has_pose);
    };
    check_sequence(name, count, frame_at, config);
}

burin_config config_of(float voxel_m) {
    burin_config c = burin_config_default();
    c.voxel_m = voxel_m;
    return c;
}

// What further models of an emulated machine go through: both sensors, with and without colour, for a few
// frames.
TEST(GoldenShort, IclOffice) {
    BURIN_NEED_DATA(icl_office_kt3_noisy);
    check_recorded(icl_office_kt3_noisy_path, "icl_office_kt3_noisy 3 frames 10 mm", 3, config_of(0.01f));
}

TEST(GoldenShort, TumStructure) {
    BURIN_NEED_DATA(tum_fr3_structure_notexture_far);
    check_recorded(tum_fr3_structure_notexture_far_path, "tum_fr3_structure_notexture_far 10 frames 10 mm",
                   10, config_of(0.01f));
}

TEST(Golden, IclOffice) {
    BURIN_NEED_DATA(icl_office_kt3_noisy);
    check_recorded(icl_office_kt3_noisy_path, "icl_office_kt3_noisy 30 frames 10 mm", 30, config_of(0.01f));
}

// Two hundred real frames: the averages have wandered and chunks have been carved.
TEST(Golden, TumStructure) {
    BURIN_NEED_DATA(tum_fr3_structure_notexture_far);
    check_recorded(tum_fr3_structure_notexture_far_path, "tum_fr3_structure_notexture_far 200 frames 10 mm",
                   200, config_of(0.01f));
}

TEST(Golden, TumStructureWithoutColour) {
    BURIN_NEED_DATA(tum_fr3_structure_notexture_far);
    burin_config config = config_of(0.01f);
    config.colour = 0;
    check_recorded(tum_fr3_structure_notexture_far_path,
                   "tum_fr3_structure_notexture_far 200 frames 10 mm without colour", 200, config);
}

#endif

}  // namespace
}  // namespace burin
