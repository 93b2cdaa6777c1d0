// SPDX-License-Identifier: MIT
#include "api/config.h"

#include <algorithm>
#include <cmath>

#include "api/handles.h"

namespace burin {
namespace {

Status in_range(const char* field, double value, double low, double high) {
    // The fields are floats: 0.01f is a little less than 0.01.
    constexpr double kFloat = 1e-7;
    if (value >= low * (1 - kFloat) && value <= high * (1 + kFloat)) return {};
    return Status::error(Code::invalid_argument, "config: %s is %g, expected %g to %g", field, value, low,
                         high);
}

// Noise model of the quadratic truncation (Chisel 2015, as in OpenChisel's QuadraticTruncator), metres.
constexpr float kQuadratic[3] = {0.0019f, 0.00152f, 0.001504f};

// A view this many voxels deep is marked in some 2000 slabs a frame: more is a mistake in units.
constexpr double kMaxViewVoxels = 10000;

}  // namespace

Status check_config(const burin_config& c) {
    if (c.struct_size != sizeof(burin_config) || c.version != BURIN_CONFIG_VERSION)
        return Status::error(
            Code::invalid_argument,
            "config: size %u and version %u, expected %zu and %u (start from burin_config_default())",
            c.struct_size, c.version, sizeof(burin_config), BURIN_CONFIG_VERSION);
    BURIN_TRY(in_range("voxel_m", c.voxel_m, 0.0005, 1));
    BURIN_TRY(in_range("truncation_voxels", c.truncation_voxels, 2, 32));
    BURIN_TRY(in_range("truncation", c.truncation, 0, BURIN_TRUNCATION_QUADRATIC));
    BURIN_TRY(in_range("truncation_scale", c.truncation_scale, 1, 32));
    BURIN_TRY(in_range("truncation_along", c.truncation_along, 0, BURIN_TRUNCATION_ALONG_RAY));
    BURIN_TRY(in_range("min_depth_m", c.min_depth_m, 0.01, 49));
    BURIN_TRY(in_range("max_depth_m", c.max_depth_m, c.min_depth_m, 50));
    BURIN_TRY(in_range("weight", c.weight, 0, BURIN_WEIGHT_INVERSE_Z2));
    BURIN_TRY(in_range("drop", c.drop, 0, BURIN_DROP_EXPONENTIAL));
    BURIN_TRY(in_range("angle_weight", c.angle_weight, 0, 1));
    BURIN_TRY(in_range("max_weight", c.max_weight, 1, 1000));
    BURIN_TRY(in_range("carve", c.carve, 0, 1));
    BURIN_TRY(in_range("colour", c.colour, 0, 1));
    BURIN_TRY(in_range("bilateral", c.bilateral, 0, 1));
    BURIN_TRY(in_range("edge_removal", c.edge_removal, 0, 1));
    BURIN_TRY(in_range("max_width", c.max_width, 1, kMaxImageSide));
    BURIN_TRY(in_range("max_height", c.max_height, 1, kMaxImageSide));
    BURIN_TRY(in_range("threads", c.threads, 1, kMaxThreads));
    BURIN_TRY(in_range("store_chunks", c.store_chunks, 0, 1u << 27));
    BURIN_TRY(in_range("tracker", c.tracker, 0, BURIN_TRACKER_ICP));
    BURIN_TRY(in_range("track_colour", c.track_colour, 0, 1));
    BURIN_TRY(in_range("track_gyro", c.track_gyro, 0, 1));
    BURIN_TRY(in_range("planes", c.planes, 0, 1));
    for (const std::uint32_t reserved : c.reserved)
        if (reserved != 0)
            return Status::error(Code::invalid_argument, "config: a reserved field is %u, expected 0",
                                 reserved);
    if (c.max_depth_m > kMaxViewVoxels * c.voxel_m * (1 + 1e-6))
        return Status::error(Code::invalid_argument,
                             "config: max_depth_m is %g, expected at most %g, 10000 voxels of voxel_m %g",
                             static_cast<double>(c.max_depth_m), kMaxViewVoxels * c.voxel_m,
                             static_cast<double>(c.voxel_m));
    return {};
}

FusionOptions options_of(const burin_config& c) {
    FusionOptions o;
    o.budget_bytes = c.budget_bytes;

    simd::TruncationModel& tau = o.integration.truncation;
    tau.floor_m = c.truncation_voxels * c.voxel_m;
    tau.quadratic = c.truncation == BURIN_TRUNCATION_QUADRATIC;
    tau.a = kQuadratic[0] * c.truncation_scale;
    tau.b = kQuadratic[1] * c.truncation_scale;
    tau.c = kQuadratic[2] * c.truncation_scale;
    tau.truncation_m = tau.floor_m;
    if (tau.quadratic) {
        const float z = c.max_depth_m;
        tau.truncation_m = std::max(tau.floor_m, (tau.a * z + tau.b) * z + tau.c);
    }

    o.integration.drop = static_cast<simd::Drop>(c.drop);
    o.integration.drop_start_m = c.voxel_m;
    o.integration.max_weight = static_cast<std::uint16_t>(c.max_weight * simd::kWeightOne);
    o.integration.along_ray = c.truncation_along == BURIN_TRUNCATION_ALONG_RAY;
    o.integration.carve = c.carve != 0;

    o.tracking.tracker = static_cast<Tracker>(c.tracker);
    o.tracking.colour = c.track_colour != 0;
    o.tracking.gyro = c.track_gyro != 0;

    o.planes.enabled = c.planes != 0;
    o.store_chunks = c.store_chunks;
    o.volume.colour = c.colour != 0;
    o.volume.voxel_m = c.voxel_m;
    o.volume.truncation_m = tau.truncation_m;

    o.depth.min_depth_m = c.min_depth_m;
    o.depth.max_depth_m = c.max_depth_m;
    o.depth.bilateral = c.bilateral != 0;
    o.depth.edge_removal = c.edge_removal != 0;
    o.depth.inverse_z2_weight = c.weight == BURIN_WEIGHT_INVERSE_Z2;
    o.depth.angle_weight = c.angle_weight != 0;
    o.depth.max_width = static_cast<int>(c.max_width);
    o.depth.max_height = static_cast<int>(c.max_height);
    return o;
}

std::uint64_t map_bytes(const FusionOptions& options, std::uint32_t capacity) {
    Arena arena;
    arena.allocate<MapState>(1, 64);
    return ((arena.used() + 63) & ~std::size_t{63}) + FusionSession::bytes_for(options, capacity);
}

Status plan_map(const burin_config& config, FusionOptions* options, std::uint64_t* bytes) {
    BURIN_TRY(check_config(config));
    *options = options_of(config);
    const std::uint64_t overhead = map_bytes(*options, 1) - FusionSession::bytes_for(*options, 1);
    FusionOptions inner = *options;
    inner.budget_bytes = config.budget_bytes > overhead ? config.budget_bytes - overhead : 0;
    std::uint64_t inner_bytes = 0;
    const std::uint32_t capacity = FusionSession::capacity_for(inner, &inner_bytes);
    if (capacity < kLeastCapacity)
        return Status::error(Code::insufficient_memory,
                             "config: budget_bytes is %llu, expected at least %llu",
                             static_cast<unsigned long long>(config.budget_bytes),
                             static_cast<unsigned long long>(map_bytes(*options, kLeastCapacity)));
    options->volume.capacity = capacity;
    *bytes = overhead + inner_bytes;
    return {};
}

}  // namespace burin
