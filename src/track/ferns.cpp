// SPDX-License-Identifier: MIT
#include "track/ferns.h"

#include <algorithm>
#include <bit>

#include "core/hash.h"

namespace burin {
namespace {

// Colour is tested against the image's own mean, channel by channel: exposure and white balance multiply a
// channel by about one factor, also after the camera's gamma, and fixed thresholds would then turn most of a
// frame's colour bits. What is lost is the mean colour itself, which the camera's automatics even out anyway.
constexpr std::uint32_t kColourUnit = 64;
// Thresholds from 1/4 to 7/4 of the mean; values beyond are rare, and a test there would nearly always say
// the same.
constexpr std::uint32_t kLeastColour = kColourUnit / 4, kMostColour = kColourUnit * 7 / 4;
// Below this mean (of 255) an image is dark or covered, and its noise of one or two levels would be all that
// the tests see: such a frame has no colour.
constexpr std::uint32_t kDarkMean = 8;
// Below a twentieth of the cells with depth, all depth bits are nearly 0 whatever the scene: no depth.
constexpr std::uint32_t kFewDepthCells = Thumbnail::kCells / 20;

constexpr std::uint32_t kNoNeighbour = ~0u;

// Whether two poses are within 5 cm and 5 degrees.
bool same_view(const Se3& a, const Se3& b) {
    constexpr double kNear_m = 0.05, kCosNear = 0.99619469809174555;  // cos 5 degrees
    const Vec3d apart = a.t - b.t;
    double trace = 0;  // of Ra^T Rb = 1 + 2 cos(angle)
    for (int i = 0; i < 9; ++i) trace += a.R.m[i] * b.R.m[i];
    return dot(apart, apart) <= kNear_m * kNear_m && trace >= 1 + 2 * kCosNear;
}

// Ferns of which any comparable bit differs.
template <int kFirstPlane, int kEndPlane>
std::uint32_t differing(const FernCode& a, const FernCode& b) {
    int sum = 0;
    for (int w = 0; w < FernCode::kWords; ++w) {
        std::uint64_t any = 0;
        for (int p = kFirstPlane; p < kEndPlane; ++p) any |= a.bits[p][w] ^ b.bits[p][w];
        sum += std::popcount(any);
    }
    return static_cast<std::uint32_t>(sum);
}

std::uint32_t differing(const FernCode& a, const FernCode& b, std::uint32_t ferns) {
    constexpr int kD = FernCode::kDepthPlane, kAll = FernCode::kPlanes;
    const std::uint32_t both = a.content & b.content, either = a.content | b.content;
    const bool depth = (both & FernCode::kHasDepth) != 0;
    if (both & FernCode::kHasColour) return depth ? differing<0, kAll>(a, b) : differing<0, kD>(a, b);
    if (!depth) return ferns;  // nothing in common
    return either & FernCode::kHasColour ? differing<kD, kAll>(a, b) : differing<0, kAll>(a, b);
}

}  // namespace

void FernKeyframes::place(Arena& arena, const FernOptions& options) {
    options_ = options;
    options_.capacity = std::clamp(options.capacity, 1u, kMaxKeyframes);
    options_.ferns = std::clamp(options.ferns, 1u, kMaxFerns);
    tests_ = arena.allocate<Test>(kMaxFerns, 64);  // a map file may ask for more than the options
    keyframes_ = arena.allocate<FernKeyframe>(options_.capacity, 64);
    neighbours_ = arena.allocate<Neighbour>(options_.capacity, 64);
    differing_ = arena.allocate<std::uint16_t>(options_.capacity, 64);
    order_ = arena.allocate<std::uint16_t>(options_.capacity, 64);
    if (order_) clear();
}

void FernKeyframes::clear() {
    const auto mm = [](float metres, float low, float high) {
        return static_cast<std::uint32_t>(std::clamp(metres * 1000 + 0.5f, low, high));
    };
    const std::uint32_t least = mm(options_.min_depth_m, 0, 65534);
    count_ = 0;
    draw_tests({options_.ferns, least, mm(options_.max_depth_m, static_cast<float>(least + 1), 65535)});
}

void FernKeyframes::draw_tests(const TestRange& range) {
    tests_of_ = range;
    std::uint64_t drawn = 0;
    // Uniform in low..high; the modulo's bias is below 1e-14.
    const auto draw = [&](std::uint32_t low, std::uint32_t high) {
        return low + static_cast<std::uint32_t>(mix64(++drawn) % (high - low + 1));
    };
    for (std::uint32_t f = 0; f < range.ferns; ++f) {
        Test& test = tests_[f];
        test.cell = static_cast<std::uint16_t>(draw(0, Thumbnail::kCells - 1));
        for (std::uint8_t& threshold : test.colour)
            threshold = static_cast<std::uint8_t>(draw(kLeastColour, kMostColour));
        for (std::uint16_t& threshold : test.depth_mm)
            threshold = static_cast<std::uint16_t>(draw(range.min_depth_mm, range.max_depth_mm));
    }
}

FernCode FernKeyframes::encode(const Thumbnail& thumbnail) const {
    FernCode code = {};
    std::uint32_t sum[3] = {}, with_depth = 0;
    for (int cell = 0; cell < Thumbnail::kCells; ++cell) {
        for (int c = 0; c < 3; ++c) sum[c] += thumbnail.rgb[3 * cell + c];
        with_depth += thumbnail.depth_mm[cell] > 0;
    }
    const bool colour = thumbnail.has_colour && sum[0] + sum[1] + sum[2] >= 3 * kDarkMean * Thumbnail::kCells;
    const bool depth = with_depth >= kFewDepthCells;
    code.content = (colour ? FernCode::kHasColour : 0u) | (depth ? FernCode::kHasDepth : 0u);
    for (std::uint32_t f = 0; f < tests_of_.ferns; ++f) {
        const Test& test = tests_[f];
        const auto set = [&](int plane, bool outcome) {
            code.bits[plane][f / 64] |= std::uint64_t{outcome} << f % 64;
        };
        const int depth_mm = thumbnail.depth_mm[test.cell];  // 0 where there is none: below every threshold
        for (int c = 0; c < 3; ++c) {
            // reading / mean > threshold
            const std::uint32_t reading = thumbnail.rgb[3 * test.cell + c];
            if (colour)
                set(c, reading * kColourUnit * Thumbnail::kCells > test.colour[c] * sum[c]);
            else if (depth)
                set(c, depth_mm > test.depth_mm[c]);
        }
        if (depth) set(FernCode::kDepthPlane, depth_mm > test.depth_mm[FernCode::kDepthPlane]);
    }
    return code;
}

void FernKeyframes::compare_all(const FernCode& code) const {
    for (std::uint32_t i = 0; i < count_; ++i)
        differing_[i] = static_cast<std::uint16_t>(differing(code, keyframes_[i].code, tests_of_.ferns));
}

float FernKeyframes::least_dissimilarity(const FernCode& code) const {
    std::uint32_t least = tests_of_.ferns;
    for (std::uint32_t i = 0; i < count_; ++i)
        least = std::min(least, differing(code, keyframes_[i].code, tests_of_.ferns));
    return static_cast<float>(least) / static_cast<float>(tests_of_.ferns);
}

// From differing_ as compared with keyframe i.
void FernKeyframes::find_neighbour(std::uint32_t i) {
    Neighbour nearest = {kNoNeighbour, kNoNeighbour};
    for (std::uint32_t k = 0; k < count_; ++k)
        if (k != i && differing_[k] < nearest.differing) nearest = {differing_[k], k};
    neighbours_[i] = nearest;
}

std::uint32_t FernKeyframes::most_redundant() const {
    std::uint32_t worst = 0;
    for (std::uint32_t i = 1; i < count_; ++i) {
        const std::uint32_t here = neighbours_[i].differing, least = neighbours_[worst].differing;
        if (here < least || (here == least && keyframes_[i].frame > keyframes_[worst].frame)) worst = i;
    }
    return worst;
}

bool FernKeyframes::add(const FernCode& code, const Se3& T_world_camera, std::uint64_t frame,
                        std::int64_t t_ns) {
    if (code.content == 0) return false;
    compare_all(code);
    std::uint32_t place = count_;
    if (count_ < options_.capacity) {
        ++count_;
    } else {
        place = most_redundant();
        const std::uint32_t least = *std::min_element(differing_, differing_ + count_);
        if (least <= neighbours_[place].differing) return false;
    }
    keyframes_[place] = {code, T_world_camera, frame, t_ns};
    find_neighbour(place);
    for (std::uint32_t i = 0; i < count_; ++i) {
        if (i == place) continue;
        Neighbour& neighbour = neighbours_[i];
        if (neighbour.keyframe == place)
            neighbour.keyframe = kNoNeighbour;  // it is gone
        else if (differing_[i] < neighbour.differing)
            neighbour = {differing_[i], place};
    }
    // Of few keyframes was the one that left the nearest, so that this is no second pass over all pairs.
    for (std::uint32_t i = 0; i < count_; ++i) {
        if (i == place || neighbours_[i].keyframe != kNoNeighbour) continue;
        compare_all(keyframes_[i].code);
        find_neighbour(i);
    }
    return true;
}

bool FernKeyframes::harvest(const FernCode& code, const Se3& T_world_camera, std::uint64_t frame,
                            std::int64_t t_ns) {
    return least_dissimilarity(code) > options_.least_dissimilarity && add(code, T_world_camera, frame, t_ns);
}

int FernKeyframes::nearest(const FernCode& code, FernMatch* out, int count) const {
    compare_all(code);
    // Counting sort: the places of a number of ferns begin where those of all smaller numbers end.
    std::uint32_t begin[kMaxFerns + 2] = {};
    for (std::uint32_t i = 0; i < count_; ++i) ++begin[differing_[i] + 1];
    for (std::uint32_t d = 0; d < kMaxFerns; ++d) begin[d + 1] += begin[d];
    for (std::uint32_t i = 0; i < count_; ++i) order_[begin[differing_[i]]++] = static_cast<std::uint16_t>(i);
    int found = 0;
    for (std::uint32_t n = 0; n < count_ && found < count; ++n) {
        const std::uint32_t i = order_[n];
        if (differing_[i] >= tests_of_.ferns) break;  // nothing in common
        const Se3& T = keyframes_[i].T_world_camera;
        const bool seen = std::any_of(
            out, out + found, [&](const FernMatch& better) { return same_view(better.T_world_camera, T); });
        if (seen) continue;
        out[found++] = {i, static_cast<float>(differing_[i]) / static_cast<float>(tests_of_.ferns), T};
    }
    return found;
}

}  // namespace burin
