// SPDX-License-Identifier: MIT
// What the commands share: outcomes, options, progress.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "burin/burin.h"
#include "core/status.h"
#include "core/triangle_mesh.h"

namespace burin::cli {

// Exit codes of the contract.
inline constexpr int kDone = 0, kFailed = 1, kBadInput = 2;

// Prints "burin: text" on stderr and returns `exit`.
int complain(int exit, const std::string& text);
// The same for a status met while reading input (always kBadInput) or while producing output (kFailed for io,
// memory and state, else kBadInput).
int complain_input(const Status& status);
int complain_output(const Status& status);

// One line on a terminal, silent elsewhere or when quiet.
class Progress {
  public:
    Progress(std::string what, int total, bool quiet);
    ~Progress();
    // done: 1..total (total 0: nobody knows); detail, e.g. "memory 120/256 MiB".
    void update(int done, const std::string& detail = {});

  private:
    std::string what_;
    int total_;
    bool shown_ = false, silent_;
    double started_ms_, last_ms_ = 0;
};

double now_ms();
std::uint64_t peak_rss_bytes();
std::string hex64(std::uint64_t value);

// "256MiB", "1.5GiB", "64MB", "4096" -> bytes.
bool parse_bytes(const std::string& text, std::uint64_t* bytes);
// "A:B" -> frames A..B-1; either may be empty.
bool parse_range(const std::string& text, int* begin, int* end);

// {p50_ms, p95_ms, mean_ms} of a report.
nlohmann::json stage_summary(std::vector<double> ms);

// The configuration shared by fuse, mesh and render of maps: flags mirror the fields of burin_config.
struct MapOptions {
    burin_config config = burin_config_default();
    std::string budget = "256MiB", weight = "constant", drop = "none", truncation_model = "constant",
                truncation_along = "axis";
    bool no_colour = false, no_carve = false;

    MapOptions();
    // The defaults of burin_scan_config_default with planes, in room for what a scan of a room takes.
    void start_from_scan();
    void add_to(CLI::App& app);
    // After parsing: what is text goes into the config; a line on error.
    Status finish();
};

// Options of the final mesh.
struct MeshFlags {
    burin_mesh_options options = burin_mesh_options_default();
    std::uint64_t min_component =
        50;  // triangles: at 5 mm voxels a patch of 25 mm, less than what one would miss
    void add_to(CLI::App& app);
};

// Extracts the whole mesh of a map, with colours if wanted, and drops its small components.
Status extract_mesh(burin_map map, const MeshFlags& flags, bool colour, TriangleMesh* mesh);

// The same when chunks are in the store: chunk by chunk, joined where they meet.
Status extract_stored_mesh(burin_map map, const MeshFlags& flags, bool colour, TriangleMesh* mesh);
// Drops the small components.
Status remove_small(const MeshFlags& flags, TriangleMesh* mesh);

// Of a map that looks for planes: labels for the faces of its mesh; then planes.json, objects.json,
// floorplan.svg and floorplan.json in the folder, by the labelled mesh. *counts: planes, objects, labels.
Status label_faces(burin_map map, TriangleMesh* mesh);
Status write_plane_files(burin_map map, const TriangleMesh& mesh, const std::string& folder,
                         nlohmann::json* counts);
// Gives the vertices the colours of the labels around them.
void paint_labels(TriangleMesh* mesh);

enum class PlanesWanted { as_saved, on, off };

// A map with its memory. Not copied.
class OwnedMap {
  public:
    ~OwnedMap();
    OwnedMap() = default;
    OwnedMap(const OwnedMap&) = delete;
    OwnedMap& operator=(const OwnedMap&) = delete;
    Status create(const burin_config& config);
    // A map for the file as it was saved, with the least budget that holds it (and `threads`), and with or
    // without planes if asked.
    Status open(const std::string& path, unsigned threads, PlanesWanted planes = PlanesWanted::as_saved);
    burin_map get() const { return map_; }

  private:
    burin_map map_ = {0, 0};
    void* memory_ = nullptr;
    std::uint64_t bytes_ = 0;
};

// The status of a C call, with its text.
Status status_of(burin_status status, burin_map map);

// Creates the folder (and its parents) and proves that it can be written to.
Status prepare_folder(const std::string& path);

// Pretty-printed JSON under the final name, or one error line.
Status write_json(const std::string& path, const nlohmann::json& json);

// Whether the file begins like a map file.
bool is_map_file(const std::string& path);

// The commands. Each adds its sub-command; the callback's result goes to *exit.
void add_fuse(CLI::App& app, int* exit);
void add_scan(CLI::App& app, int* exit);
void add_synth(CLI::App& app, int* exit);
void add_mesh(CLI::App& app, int* exit);
void add_planes(CLI::App& app, int* exit);
void add_render(CLI::App& app, int* exit);
void add_convert(CLI::App& app, int* exit);
void add_eval(CLI::App& app, int* exit);
void add_eval_planes(CLI::App& eval, int* exit);
void add_devices(CLI::App& app, int* exit);
void add_record(CLI::App& app, int* exit);
void add_config(CLI::App& app, int* exit);

}  // namespace burin::cli
