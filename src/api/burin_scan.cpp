// SPDX-License-Identifier: MIT
// The C boundary of scanning: frames without poses.
#include "api/c_frame.h"
#include "api/call.h"
#include "api/frame_check.h"
#include "api/frame_result.h"

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

}  // namespace

extern "C" {

burin_status burin_scan(burin_map map, const burin_frame* frame, burin_scan_result* result) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!frame) return null_argument("frame");
        if (state.config.tracker == BURIN_TRACKER_NONE)
            return Status::error(Code::state,
                                 "config.tracker is none: start from burin_scan_config_default()");
        FrameView view;
        BURIN_TRY(checked_frame(*frame, state.config, &view));
        const ScanReport r = state.session.scan(view, state.jobs);
        const burin_frame_result fused = frame_result(r.fusion, &state);
        if (!result) return {};
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
        return {};
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
