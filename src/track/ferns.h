// SPDX-License-Identifier: MIT
// Keyframes that are found again by how they look: randomised ferns over a small blurred image, after
// Glocker, Shotton, Criminisi, Izadi, "Real-Time RGB-D Camera Relocalization via Randomized Ferns for
// Keyframe Encoding", TVCG 2015, with the parameters of InfiniTAM. In fixed memory.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/arena.h"
#include "core/se3.h"
#include "track/thumbnail.h"

namespace burin {

struct FernOptions {
    std::uint32_t capacity = 1024;  // keyframes, 388 bytes each; 1..kMaxKeyframes
    std::uint32_t ferns = 500;      // 1..kMaxFerns (InfiniTAM: 500)
    // harvest() keeps a frame that differs from all kept in more than this share of the ferns (InfiniTAM).
    float least_dissimilarity = 0.2f;
    float min_depth_m = 0.2f, max_depth_m = 4.0f;  // what the depth tests tell apart; 0 <= min < max <= 65
};

inline constexpr std::uint32_t kMaxFerns = 512;  // whole words of bits
inline constexpr std::uint32_t kMaxKeyframes = 65536;

// Outcomes of all tests, bit f of plane p for test p of fern f, so that frames are compared 64 ferns at a
// time. With colour the planes are red, green, blue, depth. Without, they are four thresholds of depth: a
// fern's four bits then tell frames apart nearly as well, and the same dissimilarity means about the same.
struct FernCode {
    static constexpr int kPlanes = 4, kWords = kMaxFerns / 64, kDepthPlane = 3;
    enum : std::uint32_t { kHasColour = 1, kHasDepth = 2 };

    std::uint64_t bits[kPlanes][kWords];  // those of absent ferns are 0
    std::uint32_t content;                // of the enum; of neither, it resembles nothing
    std::uint32_t zero;                   // 0, so that a keyframe has no byte without a meaning
};

// Also the record of the map file, byte for byte.
struct FernKeyframe {
    FernCode code;
    Se3 T_world_camera;
    std::uint64_t frame;
    std::int64_t t_ns;
};
static_assert(sizeof(FernKeyframe) == 376);

struct FernMatch {
    std::uint32_t keyframe;  // for keyframe(); until the next one is added
    float dissimilarity;     // share of the ferns that differ (BlockHD, eq. 3), 0..1
    Se3 T_world_camera;
};

class FernKeyframes {
  public:
    // Memory and tests. The tests come from a fixed hash: the same on every machine.
    void place(Arena& arena, const FernOptions& options);
    // Forgets all keyframes; the tests are again those of place().
    void clear();

    FernCode encode(const Thumbnail& thumbnail) const;
    // To the most similar keyframe; 1 when there is none.
    float least_dissimilarity(const FernCode& code) const;

    // Keeps the frame. False when it does not: there was neither depth nor colour, or all places are taken
    // and this frame is the most redundant itself. Otherwise, when all places are taken, the most redundant
    // keyframe goes: the one that is nearest to another, which will answer in its place, so that every part
    // of what was seen stays covered; of two that are nearest to each other the later one, whose pose has
    // drifted longer.
    bool add(const FernCode& code, const Se3& T_world_camera, std::uint64_t frame, std::int64_t t_ns);
    // The same only when the frame looks new (options.least_dissimilarity).
    bool harvest(const FernCode& code, const Se3& T_world_camera, std::uint64_t frame, std::int64_t t_ns);

    // The `count` most similar keyframes, best first, equal ones by their places. Left out is whatever lies
    // within 5 cm and 5 degrees of a better one: trying both would be no second try. Also what differs in
    // every fern, such as depth from colour. Returns how many. Calls share memory: one at a time.
    int nearest(const FernCode& code, FernMatch* out, int count) const;

    std::uint32_t count() const { return count_; }
    const FernKeyframe& keyframe(std::uint32_t i) const { return keyframes_[i]; }
    const FernOptions& options() const { return options_; }
    std::uint32_t ferns() const { return tests_of_.ferns; }

  private:
    friend class FernSection;  // the map file

    // What the tests depend on. After loading it is the file's, so that its codes stay comparable.
    struct TestRange {
        std::uint32_t ferns;
        std::uint32_t min_depth_mm, max_depth_mm;
    };
    struct Test {
        std::uint16_t cell;
        std::uint8_t colour[3];  // thresholds, in 1 / kColourUnit of the image's mean
        std::uint16_t depth_mm[FernCode::kPlanes];
    };
    struct Neighbour {  // the most similar other keyframe
        std::uint32_t differing, keyframe;
    };

    void draw_tests(const TestRange& range);
    void compare_all(const FernCode& code) const;
    void find_neighbour(std::uint32_t i);
    std::uint32_t most_redundant() const;

    FernOptions options_;
    TestRange tests_of_ = {};
    std::uint32_t count_ = 0;
    Test* tests_ = nullptr;
    FernKeyframe* keyframes_ = nullptr;
    Neighbour* neighbours_ = nullptr;
    // Of the last comparison: ferns that differ, a keyframe; and the keyframes in that order.
    std::uint16_t* differing_ = nullptr;
    std::uint16_t* order_ = nullptr;
};

}  // namespace burin
