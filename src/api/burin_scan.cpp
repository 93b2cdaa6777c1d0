// SPDX-License-Identifier: MIT
// The C boundary of scanning: frames without poses.
#include "api/c_frame.h"
#include "api/call.h"
#include "api/chunk_mesh_call.h"
#include "api/frame_check.h"
#include "api/frame_result.h"
#include "capture/monotonic.h"

using namespace burin;

namespace {

burin_tracking_state state_of_tracking(TrackingState state) {
    switch (state) {
        case TrackingState::tracking:
            return BURIN_TRACKING_OK;
        case TrackingState::weak:
            return BURIN_TRACKING_WEAK;
        case TrackingState::lost:
            break;
    }
    return BURIN_TRACKING_LOST;
}

Status scan(MapState& state, const burin_frame* frame, burin_beside* beside, burin_scan_result* result) {
    if (!frame) return null_argument("frame");
    if (state.config.tracker == BURIN_TRACKER_NONE)
        return Status::error(Code::state, "config.tracker is none: start from burin_scan_config_default()");
    FrameView view, next;
    BURIN_TRY(checked_frame(*frame, state.config, &view));
    struct Meshing {
        FusionSession& session;
        ChunkMeshCall call;
        Status status;
        double ms = 0;
    } meshing = {state.session, {}, {}};
    Beside work;
    if (beside && beside->next) {
        BURIN_TRY(checked_frame(*beside->next, state.config, &next));
        work.next = &next;
    }
    if (beside && beside->key_count > 0) {
        meshing.call = {
            beside->keys, beside->key_count, beside->mesh_options, beside->mesh, beside->ranges, 0, {}};
        BURIN_TRY(meshing.call.check());
        work.context = &meshing;
        work.mesh = [](void* context, Jobs& jobs) {
            Meshing& m = *static_cast<Meshing*>(context);
            const std::int64_t start = monotonic_ns();
            m.status = m.call.run(m.session, jobs);
            m.ms = static_cast<double>(monotonic_ns() - start) * 1e-6;
        };
    }
    const ScanReport r = state.session.scan(view, state.jobs, work);
    if (beside) {
        beside->meshed = meshing.call.done;
        beside->mesh_ms = meshing.ms;
    }
    const burin_frame_result fused = frame_result(r.fusion, &state);
    if (!result) return meshing.status;
    const TrackingReport& t = r.tracking;
    *result = {};
    result->fusion = fused;
    result->state = state_of_tracking(t.state);
    result->relocalised = t.relocalised;
    result->T_world_camera = c_pose(t.state == TrackingState::lost ? Se3() : t.T_world_camera);
    result->evaluations = static_cast<std::uint32_t>(t.evaluations);
    result->free_directions = static_cast<std::uint32_t>(t.verdict.free_directions);
    result->weakest_m = static_cast<float>(t.verdict.weakest_m);
    result->known_share = static_cast<float>(t.verdict.known_share);
    result->close_share = static_cast<float>(t.verdict.close_share);
    result->keyframe_share = static_cast<float>(t.verdict.keyframe_share);
    result->track_ms = t.track_ms;
    return meshing.status;
}

}  // namespace

extern "C" {

burin_status burin_scan(burin_map map, const burin_frame* frame, burin_scan_result* result) {
    return Call(map).run([&](MapState& state) { return scan(state, frame, nullptr, result); });
}

burin_status burin_scan_beside(burin_map map, const burin_frame* frame, burin_beside* beside,
                               burin_scan_result* result) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!beside) return null_argument("beside");
        if (beside->struct_size != sizeof *beside)
            return Status::error(Code::invalid_argument, "beside: size %u, expected %zu", beside->struct_size,
                                 sizeof *beside);
        beside->meshed = 0;
        beside->mesh_ms = 0;
        return scan(state, frame, beside, result);
    });
}

burin_status burin_up(burin_map map, double up[3], double* sigma_rad) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!up) return null_argument("up");
        Vec3d direction;
        double sigma = 0;
        if (!state.session.gravity(&direction, &sigma))
            return Status::error(Code::state,
                                 "the direction of gravity is not known (no IMU, or too little of it)");
        for (int i = 0; i < 3; ++i) up[i] = direction[i];
        if (sigma_rad) *sigma_rad = sigma;
        return {};
    });
}

}  // extern "C"
