// SPDX-License-Identifier: MIT
// Configurations, memory and handles: what is out of range is refused by name, what is stated as allowed is
// not.
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "api_checks.h"
#include "core/status.h"
#include "scene_helpers.h"

namespace burin {
namespace {

TEST(Misuse, StatusCodesAreThoseOfTheCore) {
    EXPECT_EQ(static_cast<int>(Code::ok), BURIN_OK);
    EXPECT_EQ(static_cast<int>(Code::invalid_argument), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(static_cast<int>(Code::insufficient_memory), BURIN_INSUFFICIENT_MEMORY);
    EXPECT_EQ(static_cast<int>(Code::io), BURIN_IO);
    EXPECT_EQ(static_cast<int>(Code::format), BURIN_FORMAT);
    EXPECT_EQ(static_cast<int>(Code::state), BURIN_STATE);
    EXPECT_EQ(static_cast<int>(Code::unsupported), BURIN_UNSUPPORTED);
    EXPECT_EQ(static_cast<int>(Code::cancelled), BURIN_CANCELLED);
    EXPECT_EQ(static_cast<int>(Code::timeout), BURIN_TIMEOUT);
    EXPECT_EQ(static_cast<int>(Code::disconnected), BURIN_DISCONNECTED);
    EXPECT_EQ(static_cast<int>(Code::busy), BURIN_BUSY);
    EXPECT_EQ(static_cast<int>(Code::denied), BURIN_DENIED);
    EXPECT_EQ(static_cast<int>(Code::ended), BURIN_ENDED);
}

struct BadConfig {
    const char* field;
    std::function<void(burin_config&)> spoil;
};

TEST(Misuse, EveryFieldOfTheConfigurationHasItsRange) {
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    const BadConfig cases[] = {
        {"size", [](burin_config& c) { c.struct_size -= 4; }},
        {"size", [](burin_config& c) { c.struct_size += 4; }},
        {"version", [](burin_config& c) { c.version = 0; }},
        {"version", [](burin_config& c) { c.version = 2; }},
        {"voxel_m", [=](burin_config& c) { c.voxel_m = nan; }},
        {"voxel_m", [](burin_config& c) { c.voxel_m = 0; }},
        {"voxel_m", [](burin_config& c) { c.voxel_m = 1.1f; }},
        {"truncation_voxels", [](burin_config& c) { c.truncation_voxels = 1.9f; }},
        {"truncation_voxels", [=](burin_config& c) { c.truncation_voxels = inf; }},
        {"truncation", [](burin_config& c) { c.truncation = 2; }},
        {"truncation_scale", [](burin_config& c) { c.truncation_scale = 0; }},
        {"min_depth_m", [](burin_config& c) { c.min_depth_m = -1; }},
        {"min_depth_m", [](burin_config& c) { c.min_depth_m = 0.009f; }},
        {"max_depth_m", [](burin_config& c) { c.max_depth_m = 0.1f; }},
        {"max_depth_m", [](burin_config& c) { c.max_depth_m = 51; }},
        {"max_depth_m", [=](burin_config& c) { c.max_depth_m = nan; }},
        {"max_depth_m", [](burin_config& c) { c.voxel_m = 0.001f, c.max_depth_m = 11; }},
        {"weight", [](burin_config& c) { c.weight = 2; }},
        {"drop", [](burin_config& c) { c.drop = 3; }},
        {"angle_weight", [](burin_config& c) { c.angle_weight = 2; }},
        {"max_weight", [](burin_config& c) { c.max_weight = 0.5f; }},
        {"max_weight", [](burin_config& c) { c.max_weight = 1001; }},
        {"carve", [](burin_config& c) { c.carve = 2; }},
        {"colour", [](burin_config& c) { c.colour = 7; }},
        {"bilateral", [](burin_config& c) { c.bilateral = 7; }},
        {"edge_removal", [](burin_config& c) { c.edge_removal = 7; }},
        {"max_width", [](burin_config& c) { c.max_width = 0; }},
        {"max_width", [](burin_config& c) { c.max_width = 0xffffffffu; }},
        {"max_height", [](burin_config& c) { c.max_height = 16385; }},
        {"threads", [](burin_config& c) { c.threads = 0; }},
        {"threads", [](burin_config& c) { c.threads = 65; }},
        {"truncation_along", [](burin_config& c) { c.truncation_along = 2; }},
        {"reserved", [](burin_config& c) { c.reserved[1] = 1; }},
    };
    const Memory memory = aligned_memory(16u << 20);
    for (const BadConfig& bad : cases) {
        burin_config config = test_config();
        bad.spoil(config);
        std::uint64_t bytes = 77;
        EXPECT_EQ(burin_bytes(&config, &bytes), BURIN_INVALID_ARGUMENT) << bad.field;
        EXPECT_EQ(bytes, 77u);
        expect_text(kNull, bad.field);
        burin_map map{5, 5};
        EXPECT_EQ(burin_create(&config, memory.get(), 16u << 20, &map), BURIN_INVALID_ARGUMENT) << bad.field;
    }
    for (const auto& widest : {+[](burin_config& c) { c.min_depth_m = 0.01f; },
                               +[](burin_config& c) { c.voxel_m = 0.0005f, c.max_depth_m = 5; },
                               +[](burin_config& c) { c.voxel_m = 0.0007f, c.max_depth_m = 7; }}) {
        burin_config config = test_config();
        widest(config);
        std::uint64_t bytes = 0;
        EXPECT_EQ(burin_bytes(&config, &bytes), BURIN_OK)
            << "a limit that is stated must be allowed: " << burin_last_error(kNull);
    }
}

TEST(Misuse, Creation) {
    const burin_config config = test_config();
    std::uint64_t bytes = 0;
    ASSERT_EQ(burin_bytes(&config, &bytes), BURIN_OK);
    Memory memory = aligned_memory(bytes + 64);
    auto* raw = static_cast<char*>(memory.get());
    burin_map map{0, 0};
    EXPECT_EQ(burin_bytes(nullptr, &bytes), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_bytes(&config, nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_create(nullptr, raw, bytes, &map), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_create(&config, nullptr, bytes, &map), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_create(&config, raw, bytes, nullptr), BURIN_INVALID_ARGUMENT);
    for (const int off : {1, 8, 32})
        EXPECT_EQ(burin_create(&config, raw + off, bytes, &map), BURIN_INVALID_ARGUMENT);
    expect_text(kNull, "aligned to 64");
    EXPECT_EQ(burin_create(&config, raw, bytes - 1, &map), BURIN_INSUFFICIENT_MEMORY);
    expect_text(kNull, std::to_string(bytes));
    EXPECT_EQ(burin_create(&config, raw, 0, &map), BURIN_INSUFFICIENT_MEMORY);
    EXPECT_EQ(map.index, 0u);
    EXPECT_EQ(burin_create(&config, raw, bytes, &map), BURIN_OK);
    EXPECT_EQ(burin_destroy(&map), BURIN_OK);
}

TEST(Misuse, AtMostSixtyFourMapsAndHandlesGoStale) {
    burin_config config = test_config();
    config.budget_bytes = 2u << 20;
    std::vector<std::unique_ptr<ApiMap>> maps;
    for (int i = 0; i < 64; ++i) maps.push_back(std::make_unique<ApiMap>(config));
    std::uint64_t bytes = 0;
    ASSERT_EQ(burin_bytes(&config, &bytes), BURIN_OK);
    const Memory memory = aligned_memory(bytes);
    burin_map one_more{0, 0};
    EXPECT_EQ(burin_create(&config, memory.get(), bytes, &one_more), BURIN_STATE);
    expect_text(kNull, "64 maps");
    EXPECT_EQ(one_more.index, 0u);
    burin_map stale = maps[17]->map;
    maps[17].reset();
    EXPECT_EQ(burin_create(&config, memory.get(), bytes, &one_more), BURIN_OK)
        << "the place of a destroyed map is free";
    std::uint64_t hash = 0;
    EXPECT_EQ(burin_hash(stale, &hash), BURIN_STATE) << "also when its place is taken again";
    EXPECT_EQ(burin_destroy(&stale), BURIN_STATE);
    EXPECT_EQ(burin_hash(one_more, &hash), BURIN_OK);
    EXPECT_EQ(burin_destroy(&one_more), BURIN_OK);
}

}  // namespace
}  // namespace burin
