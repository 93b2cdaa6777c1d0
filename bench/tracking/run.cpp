// SPDX-License-Identifier: MIT
#include "tracking/run.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "core/jobs.h"
#include "core/triangle_mesh.h"
#include "datasets/open.h"
#include "export/ply.h"
#include "support/frames.h"

namespace burin::bench {
namespace {

void print_frame(const TrackedFrame& f) {
    const TrackingReport& r = f.tracking;
    std::printf(
        "%4d %s %s evals %2d close %.3f known %.3f cost %.3f scale %.3f colour %.2f weakest %.2f mm "
        "free %d jump %.1f mm %.2f deg error %.1f mm\n",
        f.step, r.relocalised ? "found" : "     ",
        r.state == TrackingState::tracking ? "ok  "
        : r.state == TrackingState::weak   ? "weak"
                                           : "lost",
        r.evaluations, r.verdict.close_share, r.verdict.known_share, r.cost, r.scale,
        r.verdict.keyframe_share, 1e3 * r.verdict.weakest_m, r.verdict.free_directions,
        1e3 * r.verdict.jump_m, 57.3 * r.verdict.jump_rad, 1e3 * f.error_m());
}

// The readings of a frame that was left out go to the next one, those they share once.
void hand_on(const std::vector<ImuSample>& from, std::vector<ImuSample>* to) {
    std::vector<ImuSample> all = from;
    for (const ImuSample& s : *to)
        if (all.empty() || s.t_ns > all.back().t_ns) all.push_back(s);
    *to = std::move(all);
}

struct Freed {
    void operator()(void* memory) const { std::free(memory); }
};

// A session with its memory, of which pages that are never touched cost nothing.
struct OwnedSession {
    std::unique_ptr<void, Freed> memory;
    std::unique_ptr<FusionSession> session;

    explicit OwnedSession(FusionOptions options) {
        options.budget_bytes = std::uint64_t{2} << 30;
        std::uint64_t bytes = 0;
        options.volume.capacity = FusionSession::capacity_for(options, &bytes);
        memory.reset(std::aligned_alloc(4096, (bytes + 4095) & ~std::uint64_t{4095}));
        Arena arena(memory.get(), bytes);
        session = std::make_unique<FusionSession>();
        session->place(arena, options);
        session->clear();
    }
};

Status write_mesh_of(FusionSession& session, bool colour, const std::string& path, Jobs& jobs) {
    const MeshOptions options;
    const MeshCounts counts = session.count_mesh(options, jobs);
    TriangleMesh mesh;
    mesh.positions.resize(counts.vertices);
    mesh.normals.resize(counts.vertices);
    mesh.triangles.resize(counts.triangles);
    if (colour) mesh.colours.resize(counts.vertices);
    session.extract_mesh(options,
                         {&mesh.positions.data()->x, &mesh.normals.data()->x,
                          colour ? mesh.colours.data()->data() : nullptr, mesh.triangles.data()->data()},
                         jobs);
    return write_ply(path, mesh);
}

}  // namespace

Result<Run> track_sequence(const std::string& folder, const RunOptions& o) {
    const auto dataset = open_dataset(folder, "");
    if (!dataset.ok()) return dataset.status();
    FusionOptions options = options_of(o.config);
    options.tracking = o.tracking;
    const OwnedSession owned(options);
    FusionSession& session = *owned.session;
    std::unique_ptr<OwnedSession> truth;
    if (!o.true_mesh.empty()) truth = std::make_unique<OwnedSession>(options);
    Jobs jobs(o.threads);
    Run run;
    Frame frame;
    std::vector<ImuSample> left_over;
    int number = 0;
    std::int64_t turn_ns = 0;
    const int last = std::min(o.last, (*dataset)->frame_count());
    if (o.back) run.turn = last;
    const int steps = o.back ? 2 * last - 1 - o.first : last;
    // Decoded in between, not ahead: a thread that decodes would count and be in the way.
    for (int step = o.first; step < steps; ++step) {
        const int i = step < last ? step : 2 * (last - 1) - step;
        BURIN_TRY((*dataset)->load(i, &frame));
        if (!frame.has_pose && run.frames.empty()) continue;
        if (o.back) frame.imu.clear();
        if (step < last)
            turn_ns = frame.t_ns;
        else
            frame.t_ns = 2 * turn_ns - frame.t_ns;
        if (number++ % o.disturbance.skip != 0) {
            hand_on(left_over, &frame.imu);
            left_over = frame.imu;
            continue;
        }
        hand_on(left_over, &frame.imu);
        left_over.clear();
        disturb(o.disturbance, step, &frame);
        run.has_imu = run.has_imu || !frame.imu.empty();
        const double cpu_start = cpu_ms();
        const std::uint64_t fused = session.frames();
        const ScanReport r = session.scan(view_of(frame), jobs);
        run.frames.push_back({i, step, frame.t_ns, frame.has_pose, frame.T_world_camera, r.tracking,
                              r.fusion.depth_ms, r.fusion.integrate_ms, cpu_ms() - cpu_start});
        if (truth && session.frames() > fused && frame.has_pose)
            truth->session->integrate(view_of(frame), jobs);
        if (o.verbose) print_frame(run.frames.back());
    }
    if (!o.mesh.empty()) BURIN_TRY(write_mesh_of(session, o.config.colour, o.mesh, jobs));
    if (truth) BURIN_TRY(write_mesh_of(*truth->session, o.config.colour, o.true_mesh, jobs));
    run.chunks = session.volume().live();
    return run;
}

}  // namespace burin::bench
