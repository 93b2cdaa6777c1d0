// SPDX-License-Identifier: MIT
// Keyframe ferns: places are found again, whatever exposure does; the same codes everywhere; a full store.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <map>

#include "core/hash.h"
#include "datasets/synthetic/synth.h"
#include "fern_helpers.h"

namespace burin {
namespace {

// Ferns of which any bit differs, one by one.
int differing(const FernCode& a, const FernCode& b, std::uint32_t ferns, int first_plane = 0,
              int end_plane = 4) {
    int count = 0;
    for (std::uint32_t f = 0; f < ferns; ++f) {
        bool differs = false;
        for (int p = first_plane; p < end_plane; ++p)
            differs |= ((a.bits[p][f / 64] ^ b.bits[p][f / 64]) >> f % 64 & 1) != 0;
        count += differs;
    }
    return count;
}

Se3 at_metres(double x) { return {{}, {x, 0, 0}}; }

// ------------------------------------------------------------------------------------------------ a rendered
// room

struct Seen {
    Se3 T_world_camera;
    Thumbnail usual, darker, no_colour;
};

// Every second of 140 frames, 4.7 s of a walk, with the sensor's noise.
std::vector<Seen> walk() {
    SynthOptions options;
    options.scene = "room";
    options.frames = 140;
    options.width = 160;
    options.height = 120;
    const auto dataset = SyntheticDataset::create(options);
    EXPECT_TRUE(dataset.ok()) << dataset.status().text();
    DepthOptions depth_options;
    depth_options.max_width = 160;
    depth_options.max_height = 120;
    TestDepth depth(depth_options);
    std::vector<Seen> seen;
    for (int i = 0; i < options.frames; i += 2) {
        Frame frame;
        EXPECT_TRUE((*dataset)->load(i, &frame).ok());
        FrameView view = view_of(frame);
        const DepthImage& image = depth.prepare(view);
        Seen s;
        s.T_world_camera = frame.T_world_camera;
        s.usual = make_thumbnail(image, view);
        for (std::uint8_t& c : frame.colour.pixels) c = static_cast<std::uint8_t>(c * 7 / 10);
        s.darker = make_thumbnail(image, view);
        view.colour = {};
        s.no_colour = make_thumbnail(image, view);
        EXPECT_TRUE(s.usual.has_colour && !s.no_colour.has_colour);
        seen.push_back(s);
    }
    return seen;
}

bool near(const Se3& a, const Se3& b) { return norm(a.t - b.t) < 0.3 && degrees_between(a, b) < 20; }

TEST(Ferns, FindThePlaceAgainAtAnyExposureAndWithoutColour) {
    const std::vector<Seen> seen = walk();
    constexpr std::size_t kEvery = 7;
    TestFerns with, without;
    for (std::size_t i = 0; i < seen.size(); i += kEvery) {
        const Se3& T = seen[i].T_world_camera;
        EXPECT_TRUE(with.keyframes.add(with.keyframes.encode(seen[i].usual), T, i, 0));
        EXPECT_TRUE(without.keyframes.add(without.keyframes.encode(seen[i].no_colour), T, i, 0));
    }
    std::size_t frames = 0, near_pairs = 0;
    std::map<std::string, std::size_t> found;
    for (std::size_t i = 0; i < seen.size(); ++i) {
        if (i % kEvery == 0) continue;
        ++frames;
        const auto ask = [&](const char* what, const FernKeyframes& keyframes, const Thumbnail& thumbnail) {
            const auto best = matches(keyframes, keyframes.encode(thumbnail), 1);
            ASSERT_EQ(best.size(), 1u);
            found[what] += near(best[0].T_world_camera, seen[i].T_world_camera);
        };
        ask("the same exposure", with.keyframes, seen[i].usual);
        ask("0.7 of the exposure", with.keyframes, seen[i].darker);
        ask("depth of keyframes with colour", with.keyframes, seen[i].no_colour);
        ask("depth of keyframes without colour", without.keyframes, seen[i].no_colour);
        for (std::uint32_t k = 0; k < with.keyframes.count(); ++k)
            near_pairs += near(with.keyframes.keyframe(k).T_world_camera, seen[i].T_world_camera);
    }
    ASSERT_EQ(frames, 60u);
    EXPECT_LT(near_pairs, frames * with.keyframes.count() / 2) << "any keyframe would have done";
    ASSERT_EQ(found.size(), 4u);
    for (const auto& [what, count] : found)
        EXPECT_GE(count, frames * 9 / 10) << what << ": of " << frames << " frames";
}

TEST(Ferns, HarvestKeepsWhatLooksNew) {
    const std::vector<Seen> seen = walk();
    for (const bool colour : {true, false}) {
        TestFerns ferns;
        FernKeyframes& k = ferns.keyframes;
        for (std::size_t i = 0; i < seen.size(); ++i) {
            const FernCode code = k.encode(colour ? seen[i].usual : seen[i].no_colour);
            const bool is_new = k.least_dissimilarity(code) > k.options().least_dissimilarity;
            EXPECT_EQ(k.harvest(code, seen[i].T_world_camera, i, 33 * static_cast<std::int64_t>(i)), is_new);
            EXPECT_LE(k.least_dissimilarity(code), k.options().least_dissimilarity);
        }
        EXPECT_GE(k.count(), 5u);
        EXPECT_LE(k.count(), seen.size() / 2) << "each frame counts as new";
        EXPECT_EQ(k.keyframe(0).frame, 0u);
        EXPECT_EQ(k.keyframe(1).t_ns, 33 * static_cast<std::int64_t>(k.keyframe(1).frame));
    }
}

// ------------------------------------------------------------------------------------------------------
// codes

TEST(Ferns, CodesAreTheSameOnEveryMachine) {
    const TestFerns one, other;
    std::uint64_t h = 0;
    for (std::uint64_t place = 0; place < 20; ++place) {
        const Thumbnail thumbnail = stamp(place, 0, 0, place % 4 != 3);
        const FernCode code = one.keyframes.encode(thumbnail), again = other.keyframes.encode(thumbnail);
        EXPECT_EQ(std::memcmp(&code, &again, sizeof code), 0);
        h = hash_bytes(&code, sizeof code, h);
    }
    EXPECT_EQ(h, 9216018888840716919u)
        << "when this is meant to change, count kVersion of fern_section.cpp on";
}

TEST(Ferns, BitsAreWorthTheirPlace) {
    const TestFerns ferns;
    int set[4] = {};
    constexpr int kPlaces = 40;
    for (std::uint64_t place = 0; place < kPlaces; ++place) {
        const FernCode code = ferns.keyframes.encode(stamp(place));
        EXPECT_EQ(code.content, FernCode::kHasColour | FernCode::kHasDepth);
        for (int p = 0; p < 4; ++p) {
            EXPECT_EQ(code.bits[p][7] >> (500 - 448), 0u) << "beyond the last fern";
            for (std::uint32_t f = 0; f < 500; ++f) set[p] += code.bits[p][f / 64] >> f % 64 & 1;
        }
    }
    for (const int n : set) EXPECT_NEAR(n / (500.0 * kPlaces), 0.5, 0.1);
}

TEST(Ferns, ExposureAndWhiteBalanceChangeFewBits) {
    const TestFerns ferns;
    const Thumbnail t = stamp(1);
    const FernCode code = ferns.keyframes.encode(t);
    for (const double gain : {0.5, 0.7, 1.15}) {
        Thumbnail other = t;
        for (int i = 0; i < 3 * Thumbnail::kCells; ++i)
            other.rgb[i] = static_cast<std::uint8_t>(t.rgb[i] * gain * (i % 3 == 0 ? 0.9 : 1.0) + 0.5);
        EXPECT_LE(differing(ferns.keyframes.encode(other), code, 500), 25) << gain;
    }
}

TEST(Ferns, WhatSeesNothingIsNoKeyframe) {
    TestFerns ferns;
    FernKeyframes& k = ferns.keyframes;
    ASSERT_TRUE(k.add(k.encode(stamp(1)), {}, 0, 0));
    Thumbnail nothing = {};
    nothing.has_colour = true;  // and black
    const FernCode code = k.encode(nothing);
    EXPECT_EQ(code.content, 0u);
    EXPECT_FALSE(k.add(code, at_metres(1), 1, 1));
    EXPECT_FALSE(k.harvest(code, at_metres(1), 1, 1));
    EXPECT_EQ(k.count(), 1u);
    EXPECT_EQ(k.least_dissimilarity(code), 1.0f);
    EXPECT_TRUE(matches(k, code, 3).empty());

    Thumbnail colour = stamp(1), depth = stamp(1, 0, 0, false);
    std::fill_n(colour.depth_mm, Thumbnail::kCells, std::uint16_t{0});
    std::copy_n(stamp(1).depth_mm, Thumbnail::kCells, depth.depth_mm);
    EXPECT_EQ(k.encode(colour).content, FernCode::kHasColour);
    EXPECT_EQ(k.encode(depth).content, FernCode::kHasDepth);
    // The part there is compares as it should.
    EXPECT_EQ(k.least_dissimilarity(k.encode(colour)), 0.0f);
    EXPECT_EQ(k.least_dissimilarity(k.encode(depth)), 0.0f);
    depth = stamp(2, 0, 0, false);
    EXPECT_EQ(k.least_dissimilarity(k.encode(depth)),
              static_cast<float>(differing(k.encode(depth), k.encode(stamp(1)), 500, 3, 4)) / 500.0f);
    ASSERT_TRUE(k.add(k.encode(colour), at_metres(1), 1, 1));
    k.clear();
    EXPECT_EQ(k.least_dissimilarity(k.encode(stamp(1))), 1.0f);
    EXPECT_TRUE(matches(k, k.encode(stamp(1)), 3).empty());
    ASSERT_TRUE(k.add(k.encode(colour), {}, 0, 0));
    EXPECT_TRUE(matches(k, k.encode(depth), 3).empty()) << "colour and depth have nothing in common";
}

// --------------------------------------------------------------------------------------------------
// retrieval

TEST(Ferns, NearestAreInOrderAndApart) {
    TestFerns ferns;
    FernKeyframes& k = ferns.keyframes;
    const FernCode query = k.encode(stamp(1));
    Rng rng(5);
    std::vector<int> differs;
    for (std::uint32_t i = 0; i < 300; ++i) {
        const FernCode code = k.encode(stamp(1, 4 * rng.below(40), i % 60));
        ASSERT_TRUE(k.add(code, at_metres(0.03 * rng.below(200)), i, 0));
        differs.push_back(differing(query, code, 500));
    }
    std::vector<std::uint32_t> order(300), expected;
    for (std::uint32_t i = 0; i < 300; ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return differs[a] < differs[b]; });
    bool skipped = false, tied = false;
    for (std::size_t n = 0; n < order.size() && expected.size() < 12; ++n) {
        const Vec3d t = k.keyframe(order[n]).T_world_camera.t;
        const bool seen = std::any_of(expected.begin(), expected.end(), [&](std::uint32_t e) {
            return norm(k.keyframe(e).T_world_camera.t - t) <= 0.05;
        });
        skipped |= seen;
        if (seen) continue;
        tied |= !expected.empty() && differs[expected.back()] == differs[order[n]];
        expected.push_back(order[n]);
    }
    ASSERT_TRUE(skipped && tied) << "the test tests neither";
    const auto found = matches(k, query, 12);
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
        EXPECT_EQ(found[i].keyframe, expected[i]);
        EXPECT_EQ(found[i].dissimilarity, static_cast<float>(differs[expected[i]]) / 500.0f);
        EXPECT_EQ(found[i].T_world_camera.t, k.keyframe(expected[i]).T_world_camera.t);
    }
    EXPECT_EQ(matches(k, query, 1).size(), 1u);
}

TEST(Ferns, ViewsOfOnePlaceInOtherDirectionsAreApart) {
    TestFerns ferns;
    FernKeyframes& k = ferns.keyframes;
    const FernCode code = k.encode(stamp(1));
    for (const double degrees : {0.0, 4.9, 5.1, 11.0}) {
        const double a = degrees / 57.29577951308232;
        const Se3 T = {{{std::cos(a), 0, std::sin(a), 0, 1, 0, -std::sin(a), 0, std::cos(a)}}, {1, 2, 3}};
        ASSERT_TRUE(k.add(code, T, 0, 0));
    }
    const auto found = matches(k, code, 4);
    ASSERT_EQ(found.size(), 3u);
    EXPECT_EQ(found[1].keyframe, 2u);
    EXPECT_EQ(found[2].keyframe, 3u);
}

// -------------------------------------------------------------------------------------------------------
// full

TEST(Ferns, AFullStoreStillCoversEveryPlace) {
    FernOptions options;
    options.capacity = 8;
    TestFerns ferns(options);
    FernKeyframes& k = ferns.keyframes;
    for (std::uint64_t place = 0; place < 8; ++place)
        for (std::uint64_t again = 0; again < 6; ++again)
            k.add(k.encode(stamp(place, 20, 10 * place + again)), at_metres(static_cast<double>(place)),
                  10 * place + again, 0);
    EXPECT_EQ(k.count(), 8u);
    for (std::uint64_t place = 0; place < 8; ++place) {
        const auto best = matches(k, k.encode(stamp(place)), 1);
        ASSERT_EQ(best.size(), 1u);
        EXPECT_EQ(best[0].T_world_camera.t.x, static_cast<double>(place));
        EXPECT_EQ(k.keyframe(best[0].keyframe).frame % 10, 0u) << "the earliest of a place stays";
    }
    EXPECT_FALSE(k.add(k.encode(stamp(3, 20, 99)), at_metres(3), 99, 0)) << "is the most redundant itself";
}

// The rule as it is stated, all pairs anew at each step.
TEST(Ferns, ReplacesTheMostRedundant) {
    FernOptions options;
    options.capacity = 12;
    TestFerns ferns(options);
    FernKeyframes& k = ferns.keyframes;
    std::vector<FernKeyframe> expected;
    Rng rng(8);
    int refused = 0;
    for (std::uint64_t frame = 0; frame < 300; ++frame) {
        const FernCode code = k.encode(
            stamp(static_cast<std::uint64_t>(rng.below(6)), rng.below(600), frame, rng.below(8) != 0));
        const auto apart = [&](const FernCode& a, const FernCode& b) {
            const bool mixed = ((a.content ^ b.content) & FernCode::kHasColour) != 0;
            return differing(a, b, 500, mixed ? 3 : 0);
        };
        const auto nearest_other = [&](const FernCode& a, std::size_t self) {
            int least = 10000;
            for (std::size_t i = 0; i < expected.size(); ++i)
                if (i != self) least = std::min(least, apart(a, expected[i].code));
            return least;
        };
        const FernKeyframe here = {code, at_metres(static_cast<double>(frame)), frame, 0};
        bool keeps = true;
        if (expected.size() < options.capacity) {
            expected.push_back(here);
        } else {
            std::size_t worst = 0;
            for (std::size_t i = 1; i < expected.size(); ++i) {
                const int a = nearest_other(expected[i].code, i),
                          b = nearest_other(expected[worst].code, worst);
                if (a < b || (a == b && expected[i].frame > expected[worst].frame)) worst = i;
            }
            keeps = nearest_other(code, ~std::size_t{0}) > nearest_other(expected[worst].code, worst);
            if (keeps) expected[worst] = here;
        }
        refused += !keeps;
        ASSERT_EQ(k.add(code, here.T_world_camera, frame, 0), keeps) << "frame " << frame;
        for (std::uint32_t i = 0; i < k.count(); ++i) ASSERT_EQ(k.keyframe(i).frame, expected[i].frame);
    }
    EXPECT_GT(refused, 50);
    EXPECT_LT(refused, 280);
}

TEST(Ferns, OddOptions) {
    for (const std::uint32_t ferns : {1u, 64u, 65u, 512u, 9999u}) {
        FernOptions options;
        options.ferns = ferns;
        options.capacity = 1;
        options.min_depth_m = 3;
        options.max_depth_m = 3;
        TestFerns odd(options);
        FernKeyframes& k = odd.keyframes;
        EXPECT_EQ(k.ferns(), std::min(ferns, kMaxFerns));
        EXPECT_TRUE(k.harvest(k.encode(stamp(1)), {}, 0, 0));
        EXPECT_FALSE(k.add(k.encode(stamp(2)), {}, 1, 0)) << "one place, and it is taken";
        EXPECT_EQ(k.least_dissimilarity(k.encode(stamp(1))), 0.0f);
    }
    EXPECT_LE(TestFerns().bytes, 400u << 10) << "the default's memory";
}

}  // namespace
}  // namespace burin
