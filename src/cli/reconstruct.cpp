// SPDX-License-Identifier: MIT
#include "cli/reconstruct.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <sstream>

#include "capture/monotonic.h"
#include "export/mesh_file.h"

namespace burin::cli {
namespace {

// What a renderer that follows along would ask for after every frame: the chunks that changed, at once or
// beside the next frame.
class MeshStream {
  public:
    MeshStream(burin_map map, const burin_mesh_options& options) : map_(map), options_(options) {}
    void list() {
        while (burin_dirty_chunks(map_, keys_.data(), keys_.size(), &count_) == BURIN_INSUFFICIENT_MEMORY) {
            keys_.resize(2 * count_);
            ranges_.resize(2 * count_);
        }
        at_ = 0;
    }
    bool done() const { return at_ == count_; }
    void put_beside(burin_beside* beside) {
        beside->keys = keys_.data() + at_;
        beside->key_count = count_ - at_;
        beside->mesh_options = &options_;
        beside->mesh = &buffers_;
        beside->ranges = ranges_.data();
    }
    void count_done(std::uint64_t meshed) { at_ += meshed; }
    Status update() {
        while (!done()) {
            std::uint64_t meshed = 0;
            BURIN_TRY(status_of(burin_chunk_meshes(map_, keys_.data() + at_, count_ - at_, &options_,
                                                   &buffers_, ranges_.data(), &meshed),
                                map_));
            at_ += meshed;
        }
        return {};
    }

  private:
    static constexpr std::size_t kVertices = 1u << 20,
                                 kTriangles = 1u << 21;  // what does not fit comes in the next round
    burin_map map_;
    burin_mesh_options options_;
    std::uint64_t count_ = 0, at_ = 0;
    std::vector<burin_chunk_key> keys_{1};
    std::vector<burin_mesh_range> ranges_{1};
    std::vector<float> positions_ = std::vector<float>(3 * kVertices), normals_ = positions_;
    std::vector<std::uint8_t> colours_ = std::vector<std::uint8_t>(3 * kVertices);
    std::vector<std::uint32_t> triangles_ = std::vector<std::uint32_t>(3 * kTriangles);
    burin_mesh_buffers buffers_ = {
        kVertices, kTriangles, positions_.data(), normals_.data(), colours_.data(), triangles_.data(), 0, 0};
};

// Feeds all frames to the map. The first failing status is returned with the frame it belongs to.
Status take_frames(const ReconstructOptions& o, const ReconstructSteps& steps, FrameFeed& feed, burin_map map,
                   Totals* totals) {
    Progress progress(steps.name, feed.total(), o.quiet);
    std::unique_ptr<MeshStream> stream;
    if (o.stream_mesh) stream = std::make_unique<MeshStream>(map, o.mesh.options);
    const bool ahead = steps.scans && feed.looks_ahead();
    FeedFrame frames[2];
    bool pending = false;  // chunks are listed that were not meshed yet
    Result<bool> got = feed.next(&frames[0]);
    for (int i = 0;; ++i) {
        if (!got.ok()) return got.status();
        if (!*got) return pending ? stream->update() : Status();
        const double start = now_ms();
        const FeedFrame& frame = frames[i % 2];
        const int index = feed.index();
        burin_beside beside = {};
        beside.struct_size = sizeof beside;
        if (ahead) got = feed.next(&frames[(i + 1) % 2]);
        totals->wait_ms.push_back(now_ms() - start);
        if (ahead && got.ok() && *got) beside.next = &frames[(i + 1) % 2].view;
        if (pending) stream->put_beside(&beside);
        ++totals->frames;
        const int fused = totals->fused;
        std::string note;
        const burin_status status = steps.take(frame, map, steps.scans ? &beside : nullptr, totals, &note);
        if (status != BURIN_OK)
            return Status::error(static_cast<Code>(status), "%s: frame %d: %s", o.feed.path.c_str(), index,
                                 burin_last_error(map));
        if (frame.arrived_ns != 0)
            totals->latency_ms.push_back(static_cast<double>(monotonic_ns() - frame.arrived_ns) * 1e-6);
        const double meshing = now_ms();
        if (pending) {
            stream->count_done(beside.meshed);
            BURIN_TRY(stream->update());  // what the buffers had no room for
            pending = false;
        }
        if (totals->fused > fused) {
            // A commit that fails leaves the one before; the next tries again, and the end of the run tells.
            if (o.store_commit > 0 && totals->fused % o.store_commit == 0) burin_store_commit(map);
            if (stream) {
                stream->list();
                pending = steps.scans;
                if (!pending) BURIN_TRY(stream->update());
                totals->mesh_ms.push_back(now_ms() - meshing + beside.mesh_ms);
            }
        }
        totals->frame_ms.push_back(now_ms() - start);
        burin_statistics stats;
        burin_stats(map, &stats);
        const double used = static_cast<double>(stats.chunks_live) / stats.chunks_capacity;
        char memory[80];
        std::snprintf(memory, sizeof memory, "memory %.0f/%.0f MiB",
                      used * static_cast<double>(stats.arena_bytes) / 1048576,
                      static_cast<double>(stats.arena_bytes) / 1048576);
        progress.update(i + 1, note.empty() ? memory : note + ", " + memory);
        if (!ahead) got = feed.next(&frames[(i + 1) % 2]);
    }
}

double area_m2(const TriangleMesh& mesh) {
    double area = 0;
    for (const auto& t : mesh.triangles) {
        const Vec3d a = to_double(mesh.positions[t[0]]), b = to_double(mesh.positions[t[1]]),
                    c = to_double(mesh.positions[t[2]]);
        area += norm(cross(b - a, c - a)) / 2;
    }
    return area;
}

double frames_per_second(const Totals& t) {
    double ms = 0;
    for (const double f : t.frame_ms) ms += f;
    return ms > 0 ? 1000 * static_cast<double>(t.frame_ms.size()) / ms : 0;
}

// Stages overlap: the depth of the next frame and the mesh of the last one are made while this one is
// tracked.
void print_stages(const nlohmann::json& report) {
    std::printf("%-10s %9s %9s %9s\n", "ms", "median", "p95", "mean");
    for (const char* name : {"wait", "depth", "track", "integrate", "planes", "mesh", "frame"}) {
        const nlohmann::json& s = report["stages"][name];
        if (s["mean_ms"].get<double>() > 0)
            std::printf("%-10s %9.2f %9.2f %9.2f\n", name, s["p50_ms"].get<double>(),
                        s["p95_ms"].get<double>(), s["mean_ms"].get<double>());
    }
    std::printf("%.1f frames a second\n", report["frames_per_second"].get<double>());
}

nlohmann::json make_report(const ReconstructOptions& o, burin_map map, const Totals& t, double surface_m2) {
    burin_statistics s;
    burin_stats(map, &s);
    std::uint64_t hash = 0;
    burin_hash(map, &hash);
    // A chunk is 512 voxels of 4 bytes, and 4 of colour.
    const double chunk_bytes = static_cast<double>(s.chunks_live) * (o.map.config.colour ? 4096 : 2048);
    return {{"frames", t.frames},
            {"tracked", t.fused},
            {"stages",
             {{"depth", stage_summary(t.depth_ms)},
              {"track", stage_summary(t.track_ms)},
              {"integrate", stage_summary(t.integrate_ms)},
              {"mesh", stage_summary(t.mesh_ms)},
              {"planes", stage_summary(o.map.config.planes ? t.planes_ms : std::vector<double>())},
              {"wait", stage_summary(t.wait_ms)},
              {"frame", stage_summary(t.frame_ms)}}},
            {"frames_per_second", frames_per_second(t)},
            {"chunks",
             {{"live", s.chunks_live},
              {"high_water", s.chunks_high_water},
              {"capacity", s.chunks_capacity},
              {"dropped", t.dropped},
              {"evicted", s.chunks_evicted},
              {"reloaded", s.chunks_reloaded},
              {"stored", s.chunks_stored}}},
            {"memory",
             {{"budget_bytes", o.map.config.budget_bytes},
              {"arena_bytes", s.arena_bytes},
              {"store_bytes", s.store_bytes},
              {"peak_rss_bytes", peak_rss_bytes()},
              {"surface_m2", surface_m2},
              {"bytes_per_m2", surface_m2 > 0 ? chunk_bytes / surface_m2 : 0.0}}},
            {"voxel_m", s.voxel_m},
            {"truncation_m", s.truncation_m},
            {"threads", o.map.config.threads},
            {"simd", burin_simd_name()},
            {"map_hash", hex64(hash)},
            {"version", burin_version()}};
}

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
}

Status open_store(const ReconstructOptions& o, burin_map map) {
    std::error_code ignored;
    if (!o.store_resume && std::filesystem::exists(o.store, ignored))
        return Status::error(Code::invalid_argument,
                             "--store: %s exists; --store-resume goes on from its last commit",
                             o.store.c_str());
    const std::uint32_t mode = o.store_resume ? BURIN_STORE_RESUME : BURIN_STORE_NEW;
    return status_of(burin_store_open(map, o.store.c_str(), mode), map);
}

// Commits at the end; a disk that refuses is told and is no failure of the run, whose results are yet to be
// written.
void end_store(const ReconstructOptions& o, burin_map map, const Totals& totals) {
    const Status committed = status_of(burin_store_commit(map), map);
    if (!committed.ok())
        std::fprintf(stderr, "burin: %s; the store stays at its last commit\n", committed.text());
    else if (totals.store_flags & BURIN_FLAG_STORE_FULL)
        std::fprintf(stderr,
                     "burin: %s: the store was full; more room on its disk, or --store-chunks (now %u)\n",
                     o.store.c_str(), o.map.config.store_chunks);
}

// report.json, and what else belongs to the command.
Status write_report(const ReconstructOptions& o, const ReconstructSteps& steps, FrameFeed& feed,
                    burin_map map, const Totals& totals, double surface_m2, nlohmann::json* report) {
    *report = make_report(o, map, totals, surface_m2);
    if (nlohmann::json capture = feed.report(); !capture.is_null()) {
        capture["latency_ms"] = stage_summary(totals.latency_ms);
        (*report)["capture"] = std::move(capture);
    }
    if (steps.report) steps.report(totals, report);
    if (steps.finish) BURIN_TRY(steps.finish(totals));
    return write_json(o.output + "/report.json", *report);
}

// Why no frame was fused. Frames that were looked at and told nothing are an outcome: trajectory and report
// are written.
int complain_of_nothing(const ReconstructOptions& o, const ReconstructSteps& steps, FrameFeed& feed,
                        burin_map map, const Totals& totals, const std::string& note) {
    const std::string frames = "none of the " + std::to_string(totals.frames) + " frames ",
                      because = note.empty() ? "" : " (" + note + ")";
    if (totals.frames == 0 || !steps.finish)
        return complain(kBadInput,
                        o.feed.path + ": " + frames +
                            (totals.without_pose == totals.frames ? "has a pose" : "could be fused") +
                            because);
    nlohmann::json report;
    if (const Status status = write_report(o, steps, feed, map, totals, 0, &report); !status.ok())
        return complain_output(status);
    if (o.json) std::printf("%s\n", report.dump().c_str());
    return complain(kFailed, o.feed.path + ": " + frames + "could be fused" + because + "; " + o.output +
                                 " has trajectory.txt and report.json only");
}

}  // namespace

void Totals::add(const burin_frame_result& result) {
    ++fused;
    dropped += result.chunks_dropped;
    full_frames += (result.flags & BURIN_FLAG_POOL_FULL) != 0;
    store_flags |= result.flags & (BURIN_FLAG_STORE_FULL | BURIN_FLAG_STORE_FAILED);
    integrate_ms.push_back(result.integrate_ms);
    planes_ms.push_back(result.planes_ms);
}

int reconstruct(ReconstructOptions& o, const ReconstructSteps& steps) {
    if (const Status status = o.map.finish(); !status.ok()) return complain_input(status);
    if (o.store.empty() && (o.store_resume || o.store_commit > 0))
        return complain(kBadInput, "--store-resume and --store-commit go with --store PATH");
    if (o.store_resume && !o.resume.empty())
        return complain(kBadInput, "--resume and --store-resume: expected one of them, both replace the map");
    if (!o.frames.empty() && !parse_range(o.frames, &o.feed.begin, &o.feed.end))
        return complain(kBadInput, "--frames: '" + o.frames + "', expected A:B with A < B");
    const bool live = is_source_address(o.feed.path);
    if (live && !steps.scans)
        return complain(kBadInput,
                        o.feed.path + " is a sensor, whose frames have no poses; burin scan tracks it");
    o.feed.quiet = o.quiet;
    auto feed = live ? open_source_feed(o.feed) : open_dataset_feed(o.feed);
    if (!feed.ok()) return complain_input(feed.status());
    o.map.config.max_width = static_cast<std::uint32_t>((*feed)->width());
    o.map.config.max_height = static_cast<std::uint32_t>((*feed)->height());

    // An eighth of the budget; of a small one more, since a store of few chunks would soon be full.
    if (!o.store.empty() && o.map.config.store_chunks == 0) {
        const std::uint64_t budget = o.map.config.budget_bytes;
        const std::uint64_t chunks =
            std::max(budget / 8 / 36, std::min<std::uint64_t>(65536, budget / 4 / 36));
        o.map.config.store_chunks = static_cast<std::uint32_t>(std::min<std::uint64_t>(chunks, 1u << 27));
    }
    OwnedMap map;
    if (const Status status = map.create(o.map.config); !status.ok()) return complain_input(status);
    if (!o.resume.empty())
        if (const Status status = status_of(burin_load(map.get(), o.resume.c_str()), map.get()); !status.ok())
            return complain_input(status);
    if (!o.store.empty())
        if (const Status status = open_store(o, map.get()); !status.ok()) return complain_input(status);
    if (const Status status = prepare_folder(o.output); !status.ok()) return complain_output(status);

    Totals totals;
    if (const Status status = take_frames(o, steps, **feed, map.get(), &totals); !status.ok()) {
        // A sensor that went away for good takes nothing of what it showed with it.
        if (!live || totals.fused == 0) return complain_input(status);
        std::fprintf(stderr, "burin: %s; the results are of the %d frames before\n", status.text(),
                     totals.frames);
    }
    const std::vector<std::string> notes = lines_of((*feed)->notes());
    if (totals.fused == 0)
        return complain_of_nothing(o, steps, **feed, map.get(), totals, notes.empty() ? "" : notes.back());
    if (!o.quiet)
        for (const std::string& note : notes) std::fprintf(stderr, "burin: %s\n", note.c_str());
    if (totals.dropped > 0)
        std::fprintf(stderr,
                     "burin: the map is full: %llu chunks dropped in %d of %d frames; raise --budget (now "
                     "%s) or --voxel\n",
                     static_cast<unsigned long long>(totals.dropped), totals.full_frames, totals.fused,
                     o.map.budget.c_str());

    if (!o.store.empty()) end_store(o, map.get(), totals);

    if (o.map.config.planes)
        if (const Status status = status_of(burin_refresh_planes(map.get()), map.get()); !status.ok())
            return complain_output(status);
    TriangleMesh mesh;
    const double start = now_ms();
    burin_statistics stats;
    burin_stats(map.get(), &stats);
    const bool colour = !o.map.no_colour;
    const Status meshed = stats.chunks_stored > 0 ? extract_stored_mesh(map.get(), o.mesh, colour, &mesh)
                                                  : extract_mesh(map.get(), o.mesh, colour, &mesh);
    if (!meshed.ok()) return complain_output(meshed);
    if (!o.stream_mesh) totals.mesh_ms.push_back(now_ms() - start);

    if (o.map.config.planes) {
        Status status = label_faces(map.get(), &mesh);
        nlohmann::json counts;
        if (status.ok()) status = write_plane_files(map.get(), mesh, o.output, &counts);
        if (!status.ok()) return complain_output(status);
    }
    if (const Status status = write_mesh(o.output + "/" + o.mesh_name, mesh); !status.ok())
        return complain_output(status);
    if (const Status status = status_of(burin_save(map.get(), (o.output + "/map.burin").c_str()), map.get());
        !status.ok())
        return complain_output(status);
    nlohmann::json report;
    if (const Status status = write_report(o, steps, **feed, map.get(), totals, area_m2(mesh), &report);
        !status.ok())
        return complain_output(status);
    if (o.json) {
        std::printf("%s\n", report.dump().c_str());
    } else if (!o.quiet) {
        std::printf("%s: %zu vertices, %zu triangles from %d of %d frames\n",
                    (o.output + "/" + o.mesh_name).c_str(), mesh.positions.size(), mesh.triangles.size(),
                    totals.fused, totals.frames);
        print_stages(report);
    }
    return kDone;
}

void ReconstructOptions::add_to(CLI::App& app) {
    app.add_option("-o,--output", output, "folder for the results")->required();
    app.add_option("--format", feed.format, "layout of the data set (recognised by itself otherwise)");
    app.add_option("--frames", frames, "A:B, only frames A..B-1");
    app.add_option("--min-confidence", feed.min_confidence,
                   "ignore depth of less confidence; phones: 0 low, 1 medium, 2 high (default 1: what ARKit "
                   "calls low is "
                   "mostly wrong)")
        ->check(CLI::Range(0, 255));
    app.add_option("--mesh", mesh_name, "name of the mesh file: .ply .obj .glb .stl")->capture_default_str();
    app.add_option("--resume", resume, "a map.burin to go on from");
    app.add_option("--store", store, "a file for the chunks that find no room in the budget");
    app.add_flag("--store-resume", store_resume, "go on from the store's last commit");
    app.add_option("--store-commit", store_commit, "also commit the store after every so many frames")
        ->check(CLI::NonNegativeNumber);
    app.add_flag("--stream-mesh", stream_mesh,
                 "also mesh the changed chunks after every frame, as an app would");
    app.add_flag("--json", json, "print the report on stdout");
    app.add_flag("--quiet", quiet, "no progress, no notes");
    map.add_to(app);
    mesh.add_to(app);
}

}  // namespace burin::cli
