// SPDX-License-Identifier: MIT
#include "tracking/score.h"

#include <algorithm>
#include <cstdarg>
#include <cstdio>

#include "eval/trajectory.h"
#include "support/frames.h"

namespace burin::bench {
namespace {

using Json = nlohmann::ordered_json;

// An estimate so far off is no map of anything: the frame where it first happens is where to look.
constexpr double kOffM = 0.05;
// A second: when it is over, the camera should know again where it is.
constexpr int kFramesAfter = 30;

double quantile(std::vector<double> v, double share = 0.5) {
    if (v.empty()) return 0;
    std::sort(v.begin(), v.end());
    return v[static_cast<std::size_t>(share * static_cast<double>(v.size() - 1))];
}

template <class Get>
std::vector<double> column(const Run& run, Get&& get) {
    std::vector<double> values;
    for (const TrackedFrame& f : run.frames) values.push_back(get(f));
    return values;
}

// The index of the first frame that is such, null without one.
template <class Is>
Json first_frame(const Run& run, Is&& is) {
    for (const TrackedFrame& f : run.frames)
        if (is(f)) return f.index;
    return nullptr;
}

// How far the motion from a to b is wrong: the drift before a does not count.
double motion_error_m(const TrackedFrame& a, const TrackedFrame& b) {
    const Vec3d estimate = (a.tracking.T_world_camera.inverse() * b.tracking.T_world_camera).t;
    return norm(estimate - (a.T_true.inverse() * b.T_true).t);
}

struct Part {
    int ok = 0, weak = 0, lost = 0;
    double worst_ok_m = 0, worst_ok_since_m = 0;
    void add(const TrackedFrame& f, const TrackedFrame* since) {
        lost += f.lost();
        weak += f.tracking.state == TrackingState::weak;
        if (f.tracking.state != TrackingState::tracking) return;
        ++ok;
        if (!f.has_truth) return;
        worst_ok_m = std::max(worst_ok_m, f.error_m());
        if (since) worst_ok_since_m = std::max(worst_ok_since_m, motion_error_m(*since, f));
    }
    Json json() const {
        return {{"ok", ok},
                {"weak", weak},
                {"lost", lost},
                {"worst_ok_mm", 1e3 * worst_ok_m},
                {"worst_ok_since_mm", 1e3 * worst_ok_since_m}};
    }
};

// The way back through what was seen before the disturbance: all of it should be tracked again, and stand
// where it stood.
struct Return {
    int frames = 0, ok = 0, weak = 0, lost = 0;
    int first_ok = -1;         // of them, counted from the first that is back
    double worst_again_m = 0;  // between both poses of a place, where both were sure
    double worst_ok_since_m = 0;
};

Return way_back(const Run& run, const Span& span, const TrackedFrame* since) {
    Return r;
    for (const TrackedFrame& f : run.frames) {
        const bool everywhere = span.first <= run.frames.front().step;
        if (f.step < std::max(run.turn, span.last == 1 << 30 ? 0 : span.last) ||
            (!everywhere && f.index >= span.first))
            continue;
        ++r.frames;
        r.lost += f.lost();
        r.weak += f.tracking.state == TrackingState::weak;
        if (f.tracking.state != TrackingState::tracking) continue;
        if (++r.ok == 1) r.first_ok = r.frames - 1;
        if (since && f.has_truth)
            r.worst_ok_since_m = std::max(r.worst_ok_since_m, motion_error_m(*since, f));
        for (const TrackedFrame& before : run.frames)
            if (before.index == f.index && before.step < f.step &&
                before.tracking.state == TrackingState::tracking)
                r.worst_again_m = std::max(
                    r.worst_again_m, norm(f.tracking.T_world_camera.t - before.tracking.T_world_camera.t));
    }
    return r;
}

Json json_of(const Return& r) {
    return {{"frames", r.frames},
            {"ok", r.ok},
            {"weak", r.weak},
            {"lost", r.lost},
            {"first_ok", r.first_ok},
            {"worst_again_mm", 1e3 * r.worst_again_m},
            {"worst_ok_since_mm", 1e3 * r.worst_ok_since_m}};
}

// `since`: the last frame before the disturbance that was tracked.
Json around(const Run& run, const Span& span) {
    Part before, during, after;
    const TrackedFrame* since = nullptr;
    const TrackedFrame* later = nullptr;
    if (span.first <= run.frames.front().step) since = &run.frames.front();
    Json found = nullptr;  // frames after the disturbance until one is tracked again
    for (const TrackedFrame& f : run.frames) {
        const bool ok = f.tracking.state == TrackingState::tracking;
        if (f.step < span.first) {
            before.add(f, nullptr);
            if (ok && f.has_truth) since = &f;
            continue;
        }
        (span.has(f.step) ? during : after).add(f, since);
        if (span.has(f.step)) continue;
        if (found.is_null() && ok) found = f.step - span.last;
        if (f.step >= span.last + kFramesAfter && !later && f.has_truth && !f.lost()) later = &f;
    }
    Json json = {{"before", before.json()}, {"during", during.json()}, {"after", after.json()}};
    json["found_after_frames"] = found;
    json["later_frame"] = later ? Json(later->step) : Json(nullptr);
    json["later_mm"] = later ? Json(1e3 * later->error_m()) : Json(nullptr);
    json["later_since_mm"] = later && since ? Json(1e3 * motion_error_m(*since, *later)) : Json(nullptr);
    if (run.turn < 1 << 30) json["back"] = json_of(way_back(run, span, since));
    return json;
}

__attribute__((format(printf, 2, 3))) void append(std::string* text, const char* format, ...) {
    char line[512];
    va_list values;
    va_start(values, format);
    std::vsnprintf(line, sizeof line, format, values);
    va_end(values);
    *text += line;
}

}  // namespace

bool parse_span(const std::string& text, Span* span) {
    FrameRange range;
    if (!parse_range(text, &range)) return false;
    *span = {range.first, range.last};
    return true;
}

Trajectory estimate_of(const Run& run) {
    Trajectory estimate;
    for (const TrackedFrame& f : run.frames)
        if (!f.lost()) estimate.push_back({f.t_ns, f.tracking.T_world_camera});
    return estimate;
}

Result<Json> score_run(const Run& run, const Disturbance& disturbance) {
    Trajectory truth;
    for (const TrackedFrame& f : run.frames)
        if (f.has_truth) truth.push_back({f.t_ns, f.T_true});
    const Trajectory estimate = estimate_of(run);
    const auto aligned = absolute_error(estimate, truth, Alignment::se3);
    if (!aligned.ok()) return aligned.status();
    const auto unaligned = absolute_error(estimate, truth, Alignment::none);
    if (!unaligned.ok()) return unaligned.status();
    Part all;
    for (const TrackedFrame& f : run.frames) all.add(f, nullptr);
    const auto track_ms = column(run, [](const TrackedFrame& f) { return f.tracking.track_ms; });
    Json row = {
        {"frames", run.frames.size()},
        {"ok", all.ok},
        {"weak", all.weak},
        {"lost", all.lost},
        {"relocalised", std::count_if(run.frames.begin(), run.frames.end(),
                                      [](const TrackedFrame& f) { return f.tracking.relocalised; })},
        {"ate_mm", 1e3 * aligned->translation_m.rmse},
        {"ate_p50_mm", 1e3 * aligned->translation_m.median},
        {"ate_max_mm", 1e3 * aligned->translation_m.max},
        {"unaligned_mm", 1e3 * unaligned->translation_m.rmse},
        {"track_p50_ms", quantile(track_ms)},
        {"track_p95_ms", quantile(track_ms, 0.95)},
        {"depth_p50_ms", quantile(column(run, [](const TrackedFrame& f) { return f.depth_ms; }))},
        {"fuse_p50_ms", quantile(column(run, [](const TrackedFrame& f) { return f.fuse_ms; }))},
        {"scan_cpu_p50_ms", quantile(column(run, [](const TrackedFrame& f) { return f.scan_cpu_ms; }))},
        {"evaluations_p50",
         quantile(column(run, [](const TrackedFrame& f) { return double(f.tracking.evaluations); }))},
        {"chunks", run.chunks},
        {"imu", run.has_imu},
        {"first_weak",
         first_frame(run, [](const TrackedFrame& f) { return f.tracking.state == TrackingState::weak; })},
        {"first_lost", first_frame(run, [](const TrackedFrame& f) { return f.lost(); })},
        {"first_off",
         first_frame(run,
                     [](const TrackedFrame& f) { return !f.lost() && f.has_truth && f.error_m() > kOffM; })},
    };
    if (disturbance.any() || run.turn < 1 << 30) {
        const Json& d = row["disturbance"] = around(run, disturbance.span());
        row["worst_ok_since_mm"] = std::max(d["during"]["worst_ok_since_mm"].get<double>(),
                                            d["after"]["worst_ok_since_mm"].get<double>());
        if (d.contains("back")) {
            row["back_ok"] = d["back"]["ok"];
            row["back_frames"] = d["back"]["frames"];
            row["back_again_mm"] = d["back"]["worst_again_mm"];
            row["back_since_mm"] = d["back"]["worst_ok_since_mm"];
        }
    }
    return row;
}

std::string line_of(const std::string& name, const Json& row) {
    const auto number = [&](const char* key) { return row[key].get<double>(); };
    std::string line;
    append(&line, "%-34s ATE %7.2f median %6.2f max %7.2f unaligned %7.2f mm  ", name.c_str(),
           number("ate_mm"), number("ate_p50_mm"), number("ate_max_mm"), number("unaligned_mm"));
    append(&line, "lost %.0f weak %.0f of %.0f  ", number("lost"), number("weak"), number("frames"));
    append(&line, "track %.2f p95 %.2f fuse %.2f depth %.2f ms evals %.0f chunks %.0f",
           number("track_p50_ms"), number("track_p95_ms"), number("fuse_p50_ms"), number("depth_p50_ms"),
           number("evaluations_p50"), number("chunks"));
    if (!row.contains("disturbance")) return line;
    const Json& d = row["disturbance"];
    for (const char* key : {"before", "during", "after"}) {
        const Json& part = d[key];
        append(&line, "\n    %-6s ok %d weak %d lost %d, worst ok frame off %.1f mm", key,
               part["ok"].get<int>(), part["weak"].get<int>(), part["lost"].get<int>(),
               part["worst_ok_mm"].get<double>());
        const double since = part["worst_ok_since_mm"].get<double>();
        if (since > 0) append(&line, ", %.1f mm since the disturbance began", since);
    }
    if (!d["found_after_frames"].is_null())
        append(&line, "\n    tracked again after %d frames", d["found_after_frames"].get<int>());
    if (d.contains("back")) {
        const Json& b = d["back"];
        append(&line,
               "\n    back   ok %d weak %d lost %d of %d, the first ok one is number %d, worst %.1f mm from "
               "before",
               b["ok"].get<int>(), b["weak"].get<int>(), b["lost"].get<int>(), b["frames"].get<int>(),
               b["first_ok"].get<int>(), b["worst_again_mm"].get<double>());
        if (b["worst_ok_since_mm"].get<double>() > 0)
            append(&line, ", %.1f mm from the truth", b["worst_ok_since_mm"].get<double>());
    }
    if (!d["later_since_mm"].is_null())
        append(&line, "; frame %d off %.1f mm, %.1f mm since the disturbance began",
               d["later_frame"].get<int>(), d["later_mm"].get<double>(), d["later_since_mm"].get<double>());
    return line;
}

}  // namespace burin::bench
