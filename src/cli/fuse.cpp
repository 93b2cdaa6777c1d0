// SPDX-License-Identifier: MIT
// burin fuse: recorded depth with poses in, mesh, map and report out.
#include "cli/reconstruct.h"

namespace burin::cli {
namespace {

burin_status fuse_frame(const FeedFrame& frame, burin_map map, Totals* totals) {
    if (!frame.has_pose) {
        ++totals->without_pose;
        return BURIN_OK;
    }
    burin_frame_result result;
    const burin_status status = burin_integrate(map, &frame.view, &result);
    if (status != BURIN_OK) return status;
    totals->depth_ms.push_back(result.depth_ms);
    totals->add(result);
    return BURIN_OK;
}

}  // namespace

void add_fuse(CLI::App& app, int* exit) {
    auto* command =
        app.add_subcommand("fuse", "Fuse a recorded sequence with poses: mesh.ply, map.burin, report.json");
    auto o = std::make_shared<ReconstructOptions>();
    command->add_option("dataset", o->feed.path, "folder of the sequence")->required();
    o->add_to(*command);
    command->callback([o, exit] {
        *exit = reconstruct(*o, {"fuse",
                                 [](const FeedFrame& frame, burin_map map, burin_beside*, Totals* totals,
                                    std::string*) { return fuse_frame(frame, map, totals); },
                                 {},
                                 {}});
    });
}

}  // namespace burin::cli
