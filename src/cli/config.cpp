// SPDX-License-Identifier: MIT
#include <cstdio>

#include "cli/common.h"

namespace burin::cli {

void add_config(CLI::App& app, int* exit) {
    auto* command = app.add_subcommand("config", "Print the configuration");
    auto map = std::make_shared<MapOptions>();
    auto print = std::make_shared<bool>(false), json = std::make_shared<bool>(false);
    command->add_flag("--print", *print, "print every field with its value, unit and range")->required();
    command->add_flag("--json", *json, "as one JSON object");
    map->add_to(*command);
    // The parser writes through `print`, so it must live as long as the command.
    command->callback([map, json, exit, keep = print] {
        if (const Status status = map->finish(); !status.ok()) {
            *exit = complain_input(status);
            return;
        }
        const burin_config& c = map->config;
        std::uint64_t bytes = 0;
        if (const Status status = status_of(burin_bytes(&c, &bytes), burin_map{0, 0}); !status.ok()) {
            *exit = complain_input(status);
            return;
        }
        struct Row {
            const char* name;
            nlohmann::json value;
            const char* meaning;
        };
        const Row rows[] = {
            {"budget_bytes", c.budget_bytes, "bytes, everything the map may use (--budget)"},
            {"voxel_m", c.voxel_m, "metres, 0.0005..1 (--voxel)"},
            {"truncation_voxels", c.truncation_voxels, "voxels, 2..32 (--truncation)"},
            {"truncation", map->truncation_model, "constant or quadratic (--truncation-model)"},
            {"truncation_scale", c.truncation_scale, "1..32, quadratic model (--truncation-scale)"},
            {"truncation_along", map->truncation_along, "axis or ray (--truncation-along)"},
            {"min_depth_m", c.min_depth_m, "metres, >= 0.01 (--min-depth)"},
            {"max_depth_m", c.max_depth_m, "metres, <= 50 and 10000 voxels (--max-depth)"},
            {"weight", map->weight, "constant or inverse-z2 (--weight)"},
            {"drop", map->drop, "none, linear or exponential (--drop)"},
            {"angle_weight", c.angle_weight, "0 or 1 (--angle-weight)"},
            {"max_weight", c.max_weight, "observations, 1..1000 (--max-weight)"},
            {"carve", c.carve, "0 or 1 (--no-carve)"},
            {"colour", c.colour, "0 or 1 (--no-colour)"},
            {"bilateral", c.bilateral, "0 or 1 (--bilateral)"},
            {"edge_removal", c.edge_removal, "0 or 1 (--edge-removal)"},
            {"max_width", c.max_width, "pixels; fuse takes the data set's"},
            {"max_height", c.max_height, "pixels; fuse takes the data set's"},
            {"threads", c.threads, "1..64 (--threads)"},
            {"store_chunks", c.store_chunks, "chunks a store may know (--store-chunks)"},
            {"bytes", bytes, "bytes that burin_create will use"},
        };
        nlohmann::json object;
        for (const Row& row : rows) {
            object[row.name] = row.value;
            if (!*json) std::printf("%-18s %-12s %s\n", row.name, row.value.dump().c_str(), row.meaning);
        }
        if (*json) std::printf("%s\n", object.dump().c_str());
    });
}

}  // namespace burin::cli
