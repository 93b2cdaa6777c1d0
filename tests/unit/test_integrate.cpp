// SPDX-License-Identifier: MIT
// Integration against a plain reference: every voxel of a box, one after the other, in double precision.
#include <gtest/gtest.h>

#include <array>
#include <map>

#include "core/hash.h"
#include "emulated.h"
#include "scene_helpers.h"

namespace burin {
namespace {

// A chunk of the reference. A voxel is ambiguous when a rounding of single precision could have decided about
// it: its projection lay within 0.002 pixel of the border between two, or its distance within 0.03 mm of the
// truncation.
struct RefChunk {
    std::array<int, kChunkVoxels> sdf{}, weight{};
    std::array<bool, kChunkVoxels> ambiguous{};
    bool exists = false, all_ambiguous = false;
};

// A chunk is carved in one of four frames, by its key, and then with four times the weight (integrator.cpp).
constexpr int kCarveEvery = 4;

class Reference {
  public:
    Reference(const burin_config& config, Vec3i low, Vec3i high)
        : config_(config), options_(options_of(config)), low_(low), high_(high) {}

    void integrate(const DepthImage& image, const Se3& T, std::uint64_t frame_number) {
        frame_number_ = frame_number;
        const Se3 T_camera_world = T.inverse();
        for (int z = low_.z; z <= high_.z; ++z)
            for (int y = low_.y; y <= high_.y; ++y)
                for (int x = low_.x; x <= high_.x; ++x) fuse({x, y, z}, image, T_camera_world);
    }
    const std::map<ChunkKey, RefChunk>& chunks() const { return chunks_; }

  private:
    struct Reading {
        bool seen = false, free = false, ambiguous = false, must_touch = false, may_touch = false;
        int distance = 0, weight = 0;
        double behind = 0, tau = 0;  // stored units
    };

    double tau(double depth) const {
        const auto& m = options_.integration.truncation;
        if (!m.quadratic) return static_cast<double>(m.truncation_m);
        return std::max(
            static_cast<double>(m.floor_m),
            (static_cast<double>(m.a) * depth + static_cast<double>(m.b)) * depth + static_cast<double>(m.c));
    }

    // Distances along the ray are longer by the length of the ray with z = 1 through the chunk's middle.
    double along(const DepthImage& image, Vec3i chunk, const Se3& T_camera_world) const {
        if (config_.truncation_along != BURIN_TRUNCATION_ALONG_RAY) return 1;
        const double side = 8 * static_cast<double>(config_.voxel_m);
        const Vec3d p =
            T_camera_world * Vec3d{(chunk.x + 0.5) * side, (chunk.y + 0.5) * side, (chunk.z + 0.5) * side};
        const double z = std::max(p.z, 1e-6);
        const Camera& c = image.camera;
        const double x = (std::clamp(c.fx * p.x / z + c.cx, 0.0, image.width - 1.0) - c.cx) / c.fx;
        const double y = (std::clamp(c.fy * p.y / z + c.cy, 0.0, image.height - 1.0) - c.cy) / c.fy;
        return std::sqrt(1 + x * x + y * y);
    }

    // Is the chunk one whose pixels are found by groups (ChunkBatch::group_reach), or nearly so?
    bool may_be_grouped(const DepthImage& image, Vec3i chunk, const Se3& T_camera_world) const {
        if (config_.truncation || config_.weight || config_.angle_weight || config_.drop) return false;
        const Camera& c = image.camera;
        const double voxel = static_cast<double>(config_.voxel_m);
        double least_z = 1e9;
        Pixel low{1e9, 1e9}, high{-1e9, -1e9};
        for (int i = 0; i < 8; ++i) {
            const Vec3d p = T_camera_world *
                            (Vec3d{8.0 * chunk.x + 7 * (i & 1) + 0.5, 8.0 * chunk.y + 7 * (i >> 1 & 1) + 0.5,
                                   8.0 * chunk.z + 7 * (i >> 2) + 0.5} *
                             voxel);
            least_z = std::min(least_z, p.z);
            if (p.z <= static_cast<double>(options_.integration.truncation.truncation_m)) return false;
            const Pixel at = project(c, p);
            low = {std::min(low.u, at.u), std::min(low.v, at.v)};
            high = {std::max(high.u, at.u), std::max(high.v, at.v)};
        }
        const Mat3d& R = T_camera_world.R;
        const auto step = [&](int axis, double f, double from, double to, int row) {
            const double across = f * R(row, axis), depth = R(2, axis);
            return voxel * std::max(std::fabs(across - from * depth), std::fabs(across - to * depth));
        };
        double reach = 0;
        for (int row = 0; row < 2; ++row) {
            const double f = row ? c.fy : c.fx, centre = row ? c.cy : c.cx;
            const double from = (row ? low.v : low.u) - centre, to = (row ? high.v : high.u) - centre;
            reach = std::max(reach, 1.5 * (step(0, f, from, to, row) + step(1, f, from, to, row)) +
                                        0.5 * step(2, f, from, to, row));
        }
        return reach / least_z < 1.01 * std::sqrt(0.1 * std::min(c.fx, c.fy));
    }

    // `middle`, when given, is that of the voxel's group of 4x4x2: where the map that is affine in the group
    // puts the voxel at another pixel than its own division does, either may be taken.
    Reading read(const DepthImage& image, Vec3d p, const Vec3d* middle, double along) const {
        Reading r;
        if (p.z <= 1e-3) return r;
        const Pixel at = project(image.camera, p);
        Pixel affine = at;
        if (middle) {
            const Pixel m = project(image.camera, *middle);
            affine.u = m.u + (at.u - m.u) * p.z / middle->z;
            affine.v = m.v + (at.v - m.v) * p.z / middle->z;
        }
        const double whole = static_cast<double>(options_.integration.truncation.truncation_m);
        // The nearest pixel, and those that rounding could take for it. 2e-3 covers single precision.
        const double reach = 2e-3;
        const auto nearest = [](double w) {
            return static_cast<int>(std::floor(std::clamp(w, -10.0, 1e5) + 0.5));
        };
        const int x = nearest(at.u), y = nearest(at.v);
        for (int v = nearest(std::min(at.v, affine.v) - reach);
             v <= nearest(std::max(at.v, affine.v) + reach); ++v)
            for (int u = nearest(std::min(at.u, affine.u) - reach);
                 u <= nearest(std::max(at.u, affine.u) + reach); ++u) {
                r.ambiguous |= u != x || v != y;
                if (u < 0 || v < 0 || u >= image.width || v >= image.height || image.at(u, v) == 0) continue;
                const double depth = static_cast<double>(image.at(u, v)) * static_cast<double>(image.unit_m);
                const double s = (depth - p.z) * along, band = tau(depth);
                r.may_touch |= s > -band - 3e-5 && s < band + 3e-5;
                r.ambiguous |= std::fabs(s + band) < 3e-5;
                if (u != x || v != y) continue;
                r.must_touch = s > -band + 3e-5 && s < band - 3e-5;
                r.seen = s > -band;
                r.free = r.seen && s >= whole;
                r.distance =
                    r.free ? 32767 : static_cast<int>(std::lround(std::max(s, -whole) / whole * 32767));
                r.behind = -s / whole * 32767;
                r.tau = band / whole * 32767;
                r.weight = image.weights ? image.weights[(y + 1) * image.stride + x + 1] : 64;
            }
        r.must_touch &= !r.ambiguous;
        return r;
    }

    int dropped_weight(const Reading& r) const {
        const double start = static_cast<double>(config_.voxel_m) /
                             static_cast<double>(options_.integration.truncation.truncation_m) * 32767;
        if (config_.drop == BURIN_DROP_NONE || r.behind <= start) return r.weight;
        const double x = (r.behind - start) / (r.tau - start);
        const double factor = config_.drop == BURIN_DROP_LINEAR ? 1 - x : std::pow(1 - 5.0 / 16 * x * x, 16);
        return r.weight * static_cast<int>(std::lround(256 * std::max(factor, 0.0))) / 256;
    }

    void average(RefChunk& c, int i, const Reading& r, int times) const {
        const int w = times * dropped_weight(r);
        if (w == 0) return;
        const auto at = static_cast<std::size_t>(i);
        c.sdf[at] += static_cast<int>(
            std::lround(static_cast<double>(w) * (r.distance - c.sdf[at]) / (c.weight[at] + w)));
        c.weight[at] = std::min(c.weight[at] + w, static_cast<int>(config_.max_weight * 64));
    }

    void fuse(Vec3i chunk, const DepthImage& image, const Se3& T_camera_world) {
        std::array<Reading, kChunkVoxels> readings;
        bool must = false, may = false;
        const double longer = along(image, chunk, T_camera_world);
        const bool grouped = may_be_grouped(image, chunk, T_camera_world);
        for (int i = 0; i < kChunkVoxels; ++i) {
            const double voxel = static_cast<double>(config_.voxel_m);
            const Vec3d p = {(8 * chunk.x + (i & 7) + 0.5) * voxel,
                             (8 * chunk.y + (i >> 3 & 7) + 0.5) * voxel,
                             (8 * chunk.z + (i >> 6) + 0.5) * voxel};
            Reading& r = readings[static_cast<std::size_t>(i)];
            const Vec3d middle = T_camera_world * Vec3d{(8 * chunk.x + (i & 4) + 2) * voxel,
                                                        (8 * chunk.y + (i >> 3 & 4) + 2) * voxel,
                                                        (8 * chunk.z + (i >> 6 & 6) + 1) * voxel};
            r = read(image, T_camera_world * p, grouped ? &middle : nullptr, longer);
            must |= r.must_touch;
            may |= r.may_touch;
        }
        auto found = chunks_.find(pack_key(chunk));
        const bool existed = found != chunks_.end() && found->second.exists;
        if (!must && !may && !existed) return;
        RefChunk& c = chunks_[pack_key(chunk)];
        // Ambiguous voxels alone: whether the chunk was touched cannot be told, unless carving does the same
        // to it.
        if (may && !must) c.all_ambiguous = true;
        c.exists |= must;
        const bool carves = config_.carve && (mix64(pack_key(chunk)) + frame_number_) % kCarveEvery == 0;
        for (int i = 0; i < kChunkVoxels; ++i) {
            const auto at = static_cast<std::size_t>(i);
            const Reading& r = readings[at];
            c.ambiguous[at] |= r.ambiguous;
            if (must) {
                if (r.seen) average(c, i, r, 1);
            } else if (carves && r.free && c.weight[at] > 0 && c.sdf[at] < 32767) {
                average(c, i, r, kCarveEvery);
            }
        }
    }

    burin_config config_;
    FusionOptions options_;
    Vec3i low_, high_;
    std::uint64_t frame_number_ = 0;
    std::map<ChunkKey, RefChunk> chunks_;
};

struct Settings {
    std::uint32_t quadratic, weight, angle, drop, carve, ray = 0;
};

class Integrate : public testing::TestWithParam<Settings> {};

TEST_P(Integrate, AgreesWithThePlainReference) {
    const Settings s = GetParam();
    // Under emulation half the pixels each way and voxels twice as wide, in a box with an eighth of the
    // chunks.
    burin_config config = test_config(sized(0.04f, 0.08f));
    config.truncation = s.quadratic;
    config.truncation_voxels = s.quadratic ? 2 : 4;  // else the floor hides the quadratic model
    config.truncation_scale = 16;
    config.weight = s.weight;
    config.angle_weight = s.angle;
    config.drop = s.drop;
    config.carve = s.carve;
    config.truncation_along = s.ray;
    config.max_weight = 4;  // reached within the sequence
    const Camera camera = test_camera(sized(160, 80), sized(120, 60));
    config.max_depth_m = 3;
    TestSession session(config);
    TestDepth depth(options_of(config).depth);
    // All that the cameras see up to there.
    Reference reference(config, kEmulated ? Vec3i{-5, -4, -2} : Vec3i{-10, -7, -3},
                        kEmulated ? Vec3i{5, 4, 5} : Vec3i{10, 7, 9});
    Rng rng(31);
    for (int i = 0; i < 12; ++i) {
        const Se3 T = arc_pose(i % 7, 7);
        AnalyticScene scene = ball_and_wall();
        if (i >= 4) scene.balls.clear();  // the ball is taken away: work for carving
        Image<float> image = scene.depth(camera, T);
        for (float& d : image.pixels) d = rng.below(20) ? d + static_cast<float>(0.003 * rng.normal()) : 0;
        // The last frames are single pixels that see far: carving must find every chunk that one of them
        // passes.
        if (i >= 7)
            for (float& d : image.pixels) d = rng.below(300) ? 0 : 1.9f;
        const FrameView frame = frame_of(image, camera, T);
        depth.prepare(frame);
        reference.integrate(depth.stage.image, T, static_cast<std::uint64_t>(i) + 1);
        session.integrate(frame);
    }

    long compared = 0, skipped = 0, off_by_one = 0, off = 0, weights_off = 0;
    int worst = 0;
    // By groups, distances are exact to 4 units; an average in fixed point is to one a frame.
    const bool weighted = s.weight || s.angle || s.drop;
    const int slack = weighted ? 1 : 3;
    std::set<ChunkKey> expected;
    for (const auto& [key, c] : reference.chunks()) {
        if (c.all_ambiguous) continue;
        ASSERT_TRUE(c.exists);
        expected.insert(key);
        const std::uint32_t slot = session.volume().find(key);
        ASSERT_NE(slot, kNoChunk);
        const ChunkGeometry& g = session.volume().geometry(slot);
        for (std::size_t i = 0; i < kChunkVoxels; ++i) {
            if (c.ambiguous[i]) {
                ++skipped;
                continue;
            }
            ++compared;
            ASSERT_EQ(g.weight[i] == 0, c.weight[i] == 0);
            const int difference = std::abs(g.sdf[i] - c.sdf[i]);
            worst = std::max(worst, difference);
            off_by_one += difference > 0 && difference <= slack;
            off += difference > slack;
            weights_off += g.weight[i] != c.weight[i];
        }
    }
    for (const ChunkKey key : session.keys())
        EXPECT_TRUE(reference.chunks().contains(key)) << "a chunk that no reading touches";
    std::printf(
        "%ld voxels compared, %ld ambiguous; %ld off by up to %d, %ld by more (at most %d), %ld weights "
        "differ\n",
        compared, skipped, off_by_one, slack, off, worst, weights_off);
    EXPECT_GT(compared, sized(60000, 7500));
    EXPECT_LT(skipped, compared / 20);
    // A distance that single precision rounds the other way moves the drop's weight by a unit in a few voxels
    // of a hundred thousand; nothing else may.
    EXPECT_LE(off, compared / 10000);
    EXPECT_LE(weights_off, compared / 10000);
    EXPECT_LE(off_by_one, compared / 6);
    EXPECT_LE(worst, 400);
    if (s.drop == BURIN_DROP_NONE) {
        EXPECT_EQ(weights_off, 0);
        EXPECT_LE(off, 5);
        EXPECT_LE(worst, weighted ? 2 : 3);  // two frames rounded the other way
    }
}

INSTANTIATE_TEST_SUITE_P(Models, Integrate,
                         testing::Values(Settings{0, 0, 0, 0, 0}, Settings{0, 0, 0, 1, 0},
                                         Settings{0, 0, 0, 2, 0}, Settings{0, 1, 0, 0, 1},
                                         Settings{0, 1, 1, 1, 1}, Settings{1, 0, 0, 0, 1},
                                         Settings{1, 1, 0, 1, 0}, Settings{1, 0, 1, 2, 1},
                                         Settings{0, 0, 1, 0, 0}, Settings{0, 0, 0, 0, 1, 1},
                                         Settings{1, 0, 0, 1, 1, 1}),
                         [](const auto& models) {
                             const Settings& s = models.param;
                             return std::string(s.quadratic ? "Quadratic" : "Constant") +
                                    (s.weight ? "InverseZ2" : "") + (s.angle ? "Angle" : "") +
                                    (s.drop == 0   ? "NoDrop"
                                     : s.drop == 1 ? "Linear"
                                                   : "Exponential") +
                                    (s.carve ? "Carve" : "") + (s.ray ? "Ray" : "");
                         });

TEST(Drop, TheApproximateExponentialIsOne) {
    // What the reference above takes for granted: (1 - 5 x^2 / 16)^16 stands for exp(-5 x^2) within 0.03.
    for (double x = 0; x <= 1; x += 0.01)
        EXPECT_NEAR(std::pow(1 - 5.0 / 16 * x * x, 16), std::exp(-5 * x * x), 0.03);
}

}  // namespace
}  // namespace burin
