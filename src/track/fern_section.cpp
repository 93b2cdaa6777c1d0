// SPDX-License-Identifier: MIT
#include "track/fern_section.h"

#include <cmath>
#include <cstring>
#include <type_traits>

namespace burin {
namespace {

constexpr char kMagic[8] = {'F', 'E', 'R', 'N', 'K', 'E', 'Y', 'S'};
// Of the tests: their drawing, and how an image is made small. Whoever changes either counts on.
constexpr std::uint32_t kVersion = 1;

struct Head {
    char magic[8];
    std::uint32_t version;
    std::uint32_t ferns;
    std::uint32_t min_depth_mm, max_depth_mm;
    std::uint32_t keyframes;
    std::uint32_t zero;
};
static_assert(sizeof(Head) == 32);
static_assert(std::is_trivially_copyable_v<FernKeyframe>);

Status damaged(const char* name, const char* what) {
    return Status::error(Code::format, "%s: map file is damaged: %s", name, what);
}

// Beyond any map: 2^21 chunks of 8 voxels of at most 1 m. Keeps coordinates of voxels inside 32 bits.
constexpr double kFarthest_m = 1e7;

bool is_pose(const Se3& T) {
    const double rows[12] = {T.R.m[0], T.R.m[1], T.R.m[2], T.t.x,    T.R.m[3], T.R.m[4],
                             T.R.m[5], T.t.y,    T.R.m[6], T.R.m[7], T.R.m[8], T.t.z};
    // Poses are products of rotations that were orthonormalised when they came in.
    constexpr double kTolerance = 1e-6;
    return se3_from_matrix(rows, 3, kTolerance).ok() && std::fabs(T.t.x) <= kFarthest_m &&
           std::fabs(T.t.y) <= kFarthest_m && std::fabs(T.t.z) <= kFarthest_m;
}

bool is_code(const FernCode& code, std::uint32_t ferns) {
    if (code.zero != 0 || code.content == 0 || code.content > (FernCode::kHasColour | FernCode::kHasDepth))
        return false;
    for (const auto& plane : code.bits)
        for (std::uint32_t w = 0; w < FernCode::kWords; ++w) {
            const std::uint32_t bits = ferns > 64 * w ? ferns - 64 * w : 0;
            if (bits < 64 && plane[w] >> bits != 0) return false;
        }
    return true;
}

}  // namespace

std::uint32_t FernSection::bytes() const {
    const std::uint32_t count = keyframes_.count();
    return count == 0 ? 0 : static_cast<std::uint32_t>(sizeof(Head) + count * sizeof(FernKeyframe));
}

Status FernSection::save(MapWriter& writer) const {
    const auto& tests = keyframes_.tests_of_;
    Head head = {{}, kVersion, tests.ferns, tests.min_depth_mm, tests.max_depth_mm, keyframes_.count(), 0};
    std::memcpy(head.magic, kMagic, sizeof kMagic);
    BURIN_TRY(writer.write(&head, sizeof head));
    return writer.write(keyframes_.keyframes_, keyframes_.count() * sizeof(FernKeyframe));
}

Status FernSection::load(MapReader& reader, std::uint32_t bytes, const char* name) {
    keyframes_.clear();
    Head head;
    if (bytes < sizeof head) return damaged(name, "the keyframes have no head");
    BURIN_TRY(reader.read(&head, sizeof head));
    if (std::memcmp(head.magic, kMagic, sizeof kMagic) != 0)
        return damaged(name, "what lies behind the chunks are no keyframes");
    if (head.version != kVersion)
        return Status::error(Code::unsupported, "%s: keyframes of version %u, this library reads version %u",
                             name, head.version, kVersion);
    if (head.ferns == 0 || head.ferns > kMaxFerns || head.max_depth_mm > 65535 ||
        head.min_depth_mm >= head.max_depth_mm || head.zero != 0 || head.keyframes > kMaxKeyframes ||
        bytes != sizeof head + head.keyframes * sizeof(FernKeyframe))
        return damaged(name, "the head of the keyframes holds impossible values");
    keyframes_.draw_tests({head.ferns, head.min_depth_mm, head.max_depth_mm});
    for (std::uint32_t i = 0; i < head.keyframes; ++i) {
        FernKeyframe k;
        BURIN_TRY(reader.read(&k, sizeof k));
        if (!is_code(k.code, head.ferns)) return damaged(name, "a keyframe's code is impossible");
        if (!is_pose(k.T_world_camera)) return damaged(name, "a keyframe's pose is impossible");
        keyframes_.add(k.code, k.T_world_camera, k.frame, k.t_ns);
    }
    return {};
}

}  // namespace burin
