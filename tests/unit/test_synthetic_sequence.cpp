// SPDX-License-Identifier: MIT
// Rendered sequences: the sensor's noise, independence of threads, files and their errors.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <vector>

#include "datasets/open.h"
#include "datasets/synthetic/builder.h"
#include "datasets/synthetic/camera_path.h"
#include "datasets/synthetic/sensor_noise.h"
#include "datasets/synthetic/synth.h"
#include "datasets/synthetic/truth_planes.h"
#include "emulated.h"

namespace burin {
namespace {

namespace fs = std::filesystem;
using synthetic::SceneBuilder;
using synthetic::Shape;

class Folder {
  public:
    Folder()
        : path_(fs::temp_directory_path() /
                ("burin_synth_" + std::to_string(::getpid()) + "_" + std::to_string(++count_))) {
        fs::create_directories(path_);
    }
    ~Folder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    std::string operator/(const std::string& name) const { return (path_ / name).string(); }

  private:
    static inline int count_ = 0;
    fs::path path_;
};

std::string bytes_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

std::map<std::string, std::string> tree(const std::string& root) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(root))
        if (entry.is_regular_file())
            files[fs::relative(entry.path(), root).string()] = bytes_of(entry.path());
    return files;
}

// A wall `distance` metres before a camera at the origin looking along +y, tilted by `angle` about the
// vertical.
std::unique_ptr<SyntheticScene> wall_at(double distance, double angle, bool post) {
    SceneBuilder b("wall", 1);
    const int grey = b.material(synthetic::Texture::plain, {0.5f, 0.5f, 0.5f}, {});
    b.object(synthetic::kWall);
    b.plane({0, distance, 0}, {std::sin(angle), -std::cos(angle), 0}, {0, 0, 1}, 10, 10, grey);
    if (post) {
        b.object(synthetic::kNone);
        b.box({-0.1, 1.0, -5}, {0.1, 1.2, 5}, grey);
    }
    b.data.bounds = {{-1, -0.5, -1}, {1, 6, 1}};
    auto scene = SyntheticScene::create(std::move(b.data));
    EXPECT_TRUE(scene.ok()) << scene.status().text();
    return std::move(*scene);
}

const Se3 kAlongY = look_at({0, 0, 0}, {0, 1, 0});

struct Spread {
    double mean = 0, sigma = 0, valid = 0;
};

// Error of the measured depth over the middle of the frame.
Spread spread_of(const SyntheticScene& scene, Jobs& jobs) {
    // Under emulation the middle alone is rendered, by the same pixels' rays.
    Camera camera = synth_camera(640, 480);
    constexpr int kX = sized(0, 240), kY = sized(0, 180);
    camera.width -= 2 * kX, camera.height -= 2 * kY;
    camera.cx -= kX, camera.cy -= kY;
    TruthImages truth;
    Image<float> depth;
    double sum = 0, squares = 0;
    int valid = 0, all = 0;
    EXPECT_TRUE(render_truth(scene, camera, kAlongY, false, jobs, &truth).ok());
    for (int frame = 0; frame < 3; ++frame) {
        sensor_depth(truth, camera, kAlongY, 5, frame, {}, jobs, &depth);
        for (int y = 190 - kY; y < 290 - kY; ++y)
            for (int x = 270 - kX; x < 370 - kX; ++x, ++all) {
                const double measured = depth.view().at(x, y);
                if (measured == 0) continue;
                const double error = measured - truth.depth_m.view().at(x, y);
                sum += error, squares += error * error, ++valid;
            }
    }
    Spread s;
    s.mean = sum / valid;
    s.sigma = std::sqrt(squares / valid - s.mean * s.mean);
    s.valid = static_cast<double>(valid) / all;
    return s;
}

TEST(SensorNoise, AxialSigmaIsNguyens) {
    Jobs jobs(2);
    for (const double z : {0.6, 1.0, 2.0, 3.0, 4.0}) {
        const Spread s =
            spread_of(*wall_at(z + 0.0137, 0, false), jobs);  // off the middle between two disparities
        const double model = 0.0012 + 0.0019 * (z + 0.0137 - 0.4) * (z + 0.0137 - 0.4);
        EXPECT_NEAR(s.sigma / model, 1, 0.1) << "at " << z << " m";
        EXPECT_LT(std::fabs(s.mean), 0.25 * model) << "at " << z << " m";
        EXPECT_GT(s.valid, 0.99);
    }
    EXPECT_NEAR(axial_sigma(1, 0), 0.001884, 1e-9);
    EXPECT_GT(axial_sigma(1, 1.4), 2 * axial_sigma(1, 1.0));
}

// Lateral noise moves edges, it must not roughen slanted planes: at 45 degrees the sigma is still the axial
// one.
TEST(SensorNoise, SlantedPlanesKeepTheAxialSigma) {
    Jobs jobs(2);
    const Spread s = spread_of(*wall_at(1.5, synthetic::kPi / 4, false), jobs);
    EXPECT_NEAR(s.sigma / axial_sigma(1.5, synthetic::kPi / 4), 1, 0.15);
    EXPECT_GT(s.valid, 0.98);
    const Spread grazing = spread_of(*wall_at(0.8, 82 * synthetic::kPi / 180, false), jobs);
    EXPECT_LT(grazing.valid, 0.5);
}

TEST(SensorNoise, MeasurementsAreWholeDisparitiesWithinTheRange) {
    Jobs jobs(1);
    const auto scene = wall_at(2, 0.6, true);
    const Camera camera = synth_camera(320, 240);
    TruthImages truth;
    Image<float> depth;
    ASSERT_TRUE(render_truth(*scene, camera, kAlongY, false, jobs, &truth).ok());
    sensor_depth(truth, camera, kAlongY, 5, 0, {}, jobs, &depth);
    for (const float z : depth.pixels) {
        if (z == 0) continue;
        EXPECT_GE(z, 0.4f);
        EXPECT_LE(z, 5.0f);
        const double steps = 351.30 / z;
        EXPECT_NEAR(steps, std::floor(steps + 0.5), 1e-3);
    }
    const Spread far = spread_of(*wall_at(5.5, 0, false), jobs);
    EXPECT_LT(far.valid, 0.05);
}

// A post 1 m away before a wall 2 m away hides the wall from a projector 75 mm to the right: a shadow on its
// left, f b (1/1 - 1/2) = 525 * 0.075 / 2 = 20 pixels wide, none on its right, and frayed edges.
TEST(SensorNoise, PostCastsTheProjectorsShadow) {
    Jobs jobs(2);
    const auto scene = wall_at(2, 0, true);
    const Camera camera = synth_camera(640, 480);
    TruthImages truth;
    Image<float> depth;
    ASSERT_TRUE(render_truth(*scene, camera, kAlongY, false, jobs, &truth).ok());
    sensor_depth(truth, camera, kAlongY, 5, 0, {}, jobs, &depth);
    const int left = 267, right = 372;  // the post covers columns 319.5 +- 52.5
    ASSERT_GT(truth.depth_m.view().at(left - 1, 240), 1.9f);
    ASSERT_LT(truth.depth_m.view().at(left, 240), 1.1f);
    const auto valid = [&](int x0, int x1) {
        double count = 0;
        for (int y = 0; y < 480; ++y)
            for (int x = x0; x < x1; ++x) count += depth.view().at(x, y) > 0;
        return count / (480.0 * (x1 - x0));
    };
    EXPECT_LT(valid(left - 16, left - 4), 0.02);
    EXPECT_GT(valid(left - 60, left - 26), 0.98);
    EXPECT_GT(valid(right + 4, right + 40), 0.98);
    EXPECT_GT(valid(left + 5, right - 5), 0.98);
    EXPECT_LT(valid(right - 2, right + 2), 0.8);
}

TEST(SensorNoise, ColourNoiseIsMildAndUnbiased) {
    Jobs jobs(1);
    TruthImages truth;
    truth.radiance = Image<float>(200, 200, 3, 0.2f);
    Image<std::uint8_t> clean, noisy;
    sensor_colour(truth, false, 1, 0, jobs, &clean);
    sensor_colour(truth, true, 1, 0, jobs, &noisy);
    EXPECT_EQ(clean.pixels.front(), 124);  // IEC 61966-2-1 gives 123.55 for 0.2
    double sum = 0, squares = 0;
    for (const std::uint8_t v : noisy.pixels) sum += v - 123.55, squares += (v - 123.55) * (v - 123.55);
    const auto n = static_cast<double>(noisy.pixels.size());
    EXPECT_NEAR(sum / n, 0, 0.1);
    EXPECT_GT(std::sqrt(squares / n), 0.8);
    EXPECT_LT(std::sqrt(squares / n), 4);
}

constexpr int kWidth = sized(120, 48), kHeight = sized(90, 36);
const char* const kAnyScene = sized("desk", "relief");  // the quickest to survey for planes

SynthOptions small(const std::string& scene, const std::string& dir) {
    SynthOptions options;
    options.scene = scene;
    options.frames = 2;
    options.width = kWidth;
    options.height = kHeight;
    options.output_dir = dir;
    return options;
}

class EverySequence : public testing::TestWithParam<const char*> {};
// Under emulation, where making a scene takes seconds, those that tests/golden does not render.
const std::vector<const char*> kScenes =
    kEmulated ? std::vector<const char*>{"relief", "figure"}
              : std::vector<const char*>{"room", "desk", "corridor", "relief", "figure"};
INSTANTIATE_TEST_SUITE_P(Scenes, EverySequence, testing::ValuesIn(kScenes),
                         [](const auto& name) { return std::string(name.param); });

TEST_P(EverySequence, SameBytesForAnyNumberOfThreads) {
    Folder folder;
    std::map<std::string, std::string> first;
    for (const int threads : {1, 2, 5}) {
        if (kEmulated && threads == 2) continue;
        Jobs jobs(threads);
        const std::string dir = folder / std::to_string(threads);
        const Status status = synthesise(small(GetParam(), dir), {}, jobs);
        ASSERT_TRUE(status.ok()) << status.text();
        const auto files = tree(dir);
        EXPECT_EQ(files.size(), 7u + 2 * 7);
        if (threads == 1) first = files;
        for (const auto& [name, bytes] : files)
            EXPECT_TRUE(bytes == first[name]) << name << " with " << threads << " threads";
    }
    Jobs jobs(2);
    SynthOptions other = small(GetParam(), folder / "other");
    other.seed = 2;
    ASSERT_TRUE(synthesise(other, {}, jobs).ok());
    const auto files = tree(other.output_dir);
    for (const char* name : {"rgb/000000.png", "depth/000001.png", "groundtruth.txt"})
        EXPECT_FALSE(files.at(name) == first[name]) << name << " is the same for another seed";
}

// No frame is black or without depth, wherever the path leads.
TEST_P(EverySequence, EveryFrameShowsSomething) {
    SynthOptions options = small(GetParam(), "");
    options.frames = default_frame_count(GetParam());
    options.noise = SynthNoise::none;
    options.width = 64, options.height = 48;
    const auto set = SyntheticDataset::create(options);
    ASSERT_TRUE(set.ok()) << set.status().text();
    Frame frame;
    for (int i = 0; i < (*set)->frame_count(); i += sized(13, 130)) {
        ASSERT_TRUE((*set)->load(i, &frame).ok());
        double valid = 0, light = 0, clipped = 0;
        for (const float z : frame.depth_f32.pixels) valid += z > 0;
        for (const std::uint8_t v : frame.colour.pixels) light += v, clipped += v > 250;
        EXPECT_GT(valid / (64 * 48), std::string(GetParam()) == "figure" ? 0.08 : 0.97) << "frame " << i;
        EXPECT_GT(light / (64 * 48 * 3), 50) << "frame " << i;
        EXPECT_LT(clipped / (64 * 48 * 3), 0.12) << "frame " << i;
    }
}

// The files read back as a TUM data set hold what the data set in memory delivers.
TEST(Sequence, FilesAndMemoryAgree) {
    Folder folder;
    for (const SynthNoise noise : {SynthNoise::none, SynthNoise::sensor}) {
        SynthOptions options = small(kAnyScene, folder / (noise == SynthNoise::none ? "none" : "sensor"));
        options.noise = noise;
        options.frames = 3;
        Jobs jobs(2);
        int calls = 0;
        std::unique_ptr<SyntheticScene> scene;
        const Status status = synthesise(
            options, [&](int, int total) { return ++calls <= total; }, jobs, &scene);
        ASSERT_TRUE(status.ok()) << status.text();
        EXPECT_EQ(calls, 3);
        ASSERT_NE(scene, nullptr);
        const auto files = open_dataset(options.output_dir, "");
        ASSERT_TRUE(files.ok()) << files.status().text();
        EXPECT_STREQ((*files)->format(), "tum");
        const auto memory = SyntheticDataset::create(options);
        ASSERT_TRUE(memory.ok()) << memory.status().text();
        ASSERT_EQ((*files)->frame_count(), 3);
        ASSERT_EQ((*memory)->frame_count(), 3);
        for (int i = 0; i < 3; ++i) {
            Frame a, b;
            ASSERT_TRUE((*files)->load(i, &a).ok());
            ASSERT_TRUE((*memory)->load(i, &b).ok());
            ASSERT_EQ(a.depth_u16.pixels.size(), b.depth_f32.pixels.size());
            for (std::size_t p = 0; p < b.depth_f32.pixels.size(); ++p)
                ASSERT_NEAR(a.depth_u16.pixels[p] * a.depth_unit_m, b.depth_f32.pixels[p], 0.0001001);
            EXPECT_EQ(a.colour.pixels, b.colour.pixels);
            ASSERT_TRUE(a.has_pose);
            EXPECT_LT(norm(a.T_world_camera.t - b.T_world_camera.t), 1e-8);
            EXPECT_LE(std::llabs(a.t_ns - b.t_ns), 1);
            EXPECT_NEAR(a.depth_camera.fx, b.depth_camera.fx, 1e-6);
        }
        Frame frame;
        EXPECT_FALSE((*memory)->load(3, &frame).ok());
        EXPECT_FALSE((*memory)->load(-1, &frame).ok());
    }
}

TEST(Sequence, ExactDepthFilesHoldTheTruth) {
    Folder folder;
    Jobs jobs(1);
    const SynthOptions options = small(kAnyScene, folder / "out");
    ASSERT_TRUE(synthesise(options, {}, jobs).ok());
    const std::string pfm = bytes_of(folder / "out/truth/depth/000001.pfm");
    const std::string head = "Pf\n" + std::to_string(kWidth) + " " + std::to_string(kHeight) + "\n-1.0\n";
    ASSERT_EQ(pfm.substr(0, head.size()), head);
    ASSERT_EQ(pfm.size(), head.size() + kWidth * kHeight * 4);
    SynthOptions exact = options;
    exact.noise = SynthNoise::none;
    const auto set = SyntheticDataset::create(exact);
    ASSERT_TRUE(set.ok());
    Frame frame;
    ASSERT_TRUE((*set)->load(1, &frame).ok());
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            std::uint32_t bits = 0;
            for (std::size_t i = 0; i < 4; ++i)
                bits |=
                    static_cast<std::uint32_t>(static_cast<unsigned char>(
                        pfm[head.size() + static_cast<std::size_t>((kHeight - 1 - y) * kWidth + x) * 4 + i]))
                    << (8 * i);
            float z;
            std::memcpy(&z, &bits, 4);
            ASSERT_EQ(z, frame.depth_f32.view().at(x, y));
        }
    SynthOptions bare = small(kAnyScene, folder / "bare");
    bare.truth_images = false;
    ASSERT_TRUE(synthesise(bare, {}, jobs).ok());
    EXPECT_EQ(tree(bare.output_dir).size(), 7u + 2 * 2);
}

TEST(Sequence, BadOptionsAreOneLineAndLeaveNothing) {
    Folder folder;
    Jobs jobs(2);
    std::ofstream(folder / "short.txt") << "0 0 0 1 0 0 0 1\n0.1 0 0 1 0 0 0 1\n";
    std::ofstream(folder / "file") << "here";
    fs::create_directories(folder / "full");
    std::ofstream(folder / "full/something") << "here";
    struct Case {
        const char* says;
        void (*spoil)(SynthOptions&, const Folder&);
    };
    const Case cases[] = {
        {"attic", [](SynthOptions& o, const Folder&) { o.scene = "attic"; }},
        {"-3", [](SynthOptions& o, const Folder&) { o.frames = -3; }},
        {"image size", [](SynthOptions& o, const Folder&) { o.width = 0; }},
        {"nowhere.txt", [](SynthOptions& o, const Folder& f) { o.trajectory_file = f / "nowhere.txt"; }},
        {"2 poses",
         [](SynthOptions& o, const Folder& f) { o.trajectory_file = f / "short.txt", o.frames = 3; }},
        {"inside a solid",
         [](SynthOptions& o, const Folder& f) {
             o.scene = "room", o.trajectory_file = f / "short.txt",
             o.T_scene_trajectory = Se3{{}, {0, 0, -5}};
         }},
        {"empty name", [](SynthOptions& o, const Folder&) { o.output_dir = ""; }},
        {"exists already", [](SynthOptions& o, const Folder& f) { o.output_dir = f / "full"; }},
        {"exists already", [](SynthOptions& o, const Folder& f) { o.output_dir = f / "file"; }},
        {"out", [](SynthOptions& o, const Folder& f) { o.output_dir = f / "file/out"; }},
    };
    for (const Case& c : cases) {
        SynthOptions options = small(kAnyScene, folder / "out");
        c.spoil(options, folder);
        const Status status = synthesise(options, {}, jobs);
        ASSERT_FALSE(status.ok()) << c.says;
        EXPECT_NE(std::string(status.text()).find(c.says), std::string::npos) << status.text();
        EXPECT_EQ(std::string(status.text()).find('\n'), std::string::npos);
        EXPECT_FALSE(fs::exists(folder / "out"));
        EXPECT_FALSE(fs::exists(folder / "out.partial"));
    }
    // Stopped half way: nothing stays. An empty folder is a fine place.
    fs::create_directories(folder / "out");
    const Status stopped = synthesise(
        small(kAnyScene, folder / "out"), [](int done, int) { return done < 1; }, jobs);
    EXPECT_EQ(stopped.code(), Code::cancelled);
    EXPECT_TRUE(fs::is_empty(folder / "out"));
    EXPECT_FALSE(fs::exists(folder / "out.partial"));
    EXPECT_TRUE(synthesise(small(kAnyScene, folder / "out/"), {}, jobs).ok());
    EXPECT_TRUE(fs::exists(folder / "out/truth/planes.json"));
}

}  // namespace
}  // namespace burin
