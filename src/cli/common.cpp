// SPDX-License-Identifier: MIT
#include "cli/common.h"

#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#include "core/atomic_file.h"

namespace burin::cli {

int complain(int exit, const std::string& text) {
    std::fprintf(stderr, "burin: %s\n", text.c_str());
    return exit;
}
int complain_input(const Status& status) { return complain(kBadInput, status.text()); }
int complain_output(const Status& status) {
    const bool work =
        status.code() == Code::io || status.code() == Code::state || status.code() == Code::cancelled;
    return complain(work ? kFailed : kBadInput, status.text());
}

double now_ms() {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

Progress::Progress(std::string what, int total, bool quiet)
    : what_(std::move(what)),
      total_(total),
      silent_(quiet || !isatty(STDERR_FILENO)),
      started_ms_(now_ms()) {}

Progress::~Progress() {
    if (shown_) std::fprintf(stderr, "\r\033[K");
}

void Progress::update(int done, const std::string& detail) {
    const double now = now_ms();
    if (silent_ || (now - last_ms_ < 100 && (done < total_ || total_ == 0)))
        return;  // ten times a second is smooth enough
    last_ms_ = now;
    shown_ = true;
    const double seconds = std::max((now - started_ms_) / 1000, 1e-6), rate = done / seconds;
    if (total_ == 0) {
        std::fprintf(stderr, "\r\033[K%s %d  %.1f fps  %s", what_.c_str(), done, rate, detail.c_str());
        std::fflush(stderr);
        return;
    }
    std::fprintf(stderr, "\r\033[K%s %d/%d  %.1f fps  %s  %.0f s left", what_.c_str(), done, total_, rate,
                 detail.c_str(), (total_ - done) / std::max(rate, 1e-6));
    std::fflush(stderr);
}

std::uint64_t peak_rss_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;  // Linux counts KiB
}

std::string hex64(std::uint64_t value) {
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
    return text;
}

bool parse_bytes(const std::string& text, std::uint64_t* bytes) {
    char* end = nullptr;
    const double number = std::strtod(text.c_str(), &end);
    if (end == text.c_str() || !(number > 0)) return false;
    static constexpr struct {
        const char* name;
        double factor;
    } kUnits[] = {{"", 1},     {"B", 1},    {"KiB", 1024.0}, {"MiB", 1048576.0}, {"GiB", 1073741824.0},
                  {"KB", 1e3}, {"kB", 1e3}, {"MB", 1e6},     {"GB", 1e9}};
    for (const auto& unit : kUnits)
        if (std::strcmp(end, unit.name) == 0 && number * unit.factor < 9e15) {
            *bytes = static_cast<std::uint64_t>(number * unit.factor);
            return true;
        }
    return false;
}

bool parse_range(const std::string& text, int* begin, int* end) {
    const std::size_t colon = text.find(':');
    if (colon == std::string::npos) return false;
    const auto number = [](const std::string& part, int* out) {
        if (part.empty()) return true;
        char* stop = nullptr;
        const long value = std::strtol(part.c_str(), &stop, 10);
        if (*stop != 0 || value < 0 || value > 1000000000) return false;
        *out = static_cast<int>(value);
        return true;
    };
    return number(text.substr(0, colon), begin) && number(text.substr(colon + 1), end) && *begin < *end;
}

nlohmann::json stage_summary(std::vector<double> ms) {
    if (ms.empty()) return {{"p50_ms", 0.0}, {"p95_ms", 0.0}, {"mean_ms", 0.0}};
    std::sort(ms.begin(), ms.end());
    double sum = 0;
    for (const double m : ms) sum += m;
    const auto quantile = [&](double q) {
        return ms[static_cast<std::size_t>(q * static_cast<double>(ms.size() - 1) + 0.5)];
    };
    return {{"p50_ms", quantile(0.5)},
            {"p95_ms", quantile(0.95)},
            {"mean_ms", sum / static_cast<double>(ms.size())}};
}

MapOptions::MapOptions() { config.threads = std::clamp(std::thread::hardware_concurrency(), 1u, 64u); }

void MapOptions::start_from_scan() {
    const std::uint32_t threads = config.threads;
    config = burin_scan_config_default();
    config.threads = threads;
    config.planes = 1;
    // A room at 5 mm with a band of 8 voxels takes 0.9 GB with colour, and planes up to half as much again.
    budget = "1536MiB";
}

void MapOptions::add_to(CLI::App& app) {
    // Not given, the field stays what it is: add_flag would make it 0.
    const auto flag = [&app](const char* names, std::uint32_t& field, const char* text) {
        app.add_flag_function(
            names, [&field](std::int64_t count) { field = count > 0; }, text);
    };
    app.add_option("--voxel", config.voxel_m, "edge of a voxel, metres")->capture_default_str();
    app.add_option("--truncation", config.truncation_voxels, "truncation distance, voxels")
        ->capture_default_str();
    app.add_option("--truncation-model", truncation_model, "constant, or quadratic in depth (Chisel)")
        ->capture_default_str();
    app.add_option("--truncation-scale", config.truncation_scale, "factor of the quadratic model")
        ->capture_default_str();
    app.add_option("--truncation-along", truncation_along,
                   "axis: distances are depth - z; or ray: along the viewing ray, as Open3D does")
        ->capture_default_str();
    app.add_option("--min-depth", config.min_depth_m, "nearer readings are ignored, metres")
        ->capture_default_str();
    app.add_option("--max-depth", config.max_depth_m, "farther readings are ignored, metres")
        ->capture_default_str();
    app.add_option("--weight", weight, "constant or inverse-z2")->capture_default_str();
    app.add_option("--drop", drop, "weight behind the surface: none, linear or exponential")
        ->capture_default_str();
    flag("--angle-weight,!--no-angle-weight", config.angle_weight, "weigh by the angle of view");
    app.add_option("--max-weight", config.max_weight, "observations the running average remembers")
        ->capture_default_str();
    app.add_flag("--no-carve", no_carve, "do not clear space that rays pass through");
    flag("--bilateral,!--no-bilateral", config.bilateral, "smooth each depth image, edges kept");
    flag("--edge-removal,!--no-edge-removal", config.edge_removal, "drop readings on jumps in depth");
    flag("--planes,!--no-planes", config.planes,
         "find planes, draw the surface to them, label them: planes.json");
    app.add_flag("--no-colour", no_colour, "geometry only");
    app.add_option("--threads", config.threads, "worker threads")->capture_default_str();
    app.add_option("--budget", budget, "bytes for the map, e.g. 64MiB")->capture_default_str();
    app.add_option("--store-chunks", config.store_chunks,
                   "chunks that a store may know, 36 bytes of the budget each (with --store: an eighth to a "
                   "quarter of it)");
}

Status MapOptions::finish() {
    const auto choice = [](const char* flag, const std::string& value, std::vector<const char*> names,
                           std::uint32_t* out) -> Status {
        std::string expected;
        for (std::size_t i = 0; i < names.size(); ++i) {
            if (value == names[i]) {
                *out = static_cast<std::uint32_t>(i);
                return {};
            }
            expected += std::string(i ? ", " : "") + names[i];
        }
        return Status::error(Code::invalid_argument, "%s: '%s', expected one of %s", flag, value.c_str(),
                             expected.c_str());
    };
    BURIN_TRY(choice("--weight", weight, {"constant", "inverse-z2"}, &config.weight));
    BURIN_TRY(choice("--drop", drop, {"none", "linear", "exponential"}, &config.drop));
    BURIN_TRY(choice("--truncation-model", truncation_model, {"constant", "quadratic"}, &config.truncation));
    BURIN_TRY(choice("--truncation-along", truncation_along, {"axis", "ray"}, &config.truncation_along));
    if (!parse_bytes(budget, &config.budget_bytes))
        return Status::error(Code::invalid_argument, "--budget: '%s', expected a size such as 64MiB or 1GiB",
                             budget.c_str());
    config.carve = !no_carve;
    config.colour = !no_colour;
    return {};
}

void MeshFlags::add_to(CLI::App& app) {
    app.add_option("--min-weight", options.min_weight, "observations a voxel needs to be known")
        ->capture_default_str();
    app.add_option("--max-jump", options.max_jump_voxels, "larger differences between voxels are no surface")
        ->capture_default_str();
    app.add_option("--min-component", min_component, "connected pieces of fewer triangles are dropped")
        ->capture_default_str();
}

Status status_of(burin_status status, burin_map map) {
    if (status == BURIN_OK) return {};
    return Status::error(static_cast<Code>(status), "%s", burin_last_error(map));
}

Status remove_small(const MeshFlags& flags, TriangleMesh* mesh) {
    if (mesh->positions.empty()) return {};
    burin_mesh_buffers buffers = {};
    buffers.vertex_capacity = buffers.vertex_count = mesh->positions.size();
    buffers.triangle_capacity = buffers.triangle_count = mesh->triangles.size();
    buffers.positions = &mesh->positions[0].x;
    buffers.normals = &mesh->normals[0].x;
    buffers.colours = mesh->colours.empty() ? nullptr : mesh->colours[0].data();
    buffers.triangles = mesh->triangles.empty() ? nullptr : mesh->triangles[0].data();
    std::vector<std::uint32_t> scratch(2 * mesh->positions.size());
    BURIN_TRY(
        status_of(burin_mesh_remove_small(&buffers, flags.min_component, scratch.data()), burin_map{0, 0}));
    mesh->positions.resize(buffers.vertex_count);
    mesh->normals.resize(buffers.vertex_count);
    if (!mesh->colours.empty()) mesh->colours.resize(buffers.vertex_count);
    mesh->triangles.resize(buffers.triangle_count);
    return {};
}

Status extract_mesh(burin_map map, const MeshFlags& flags, bool colour, TriangleMesh* mesh) {
    std::uint64_t vertices = 0, triangles = 0;
    BURIN_TRY(status_of(burin_mesh_size(map, &flags.options, &vertices, &triangles), map));
    mesh->positions.resize(vertices);
    mesh->normals.resize(vertices);
    mesh->colours.resize(colour ? vertices : 0);
    mesh->triangles.resize(triangles);
    mesh->labels.clear();
    mesh->filled.clear();
    burin_mesh_buffers buffers = {};
    buffers.vertex_capacity = vertices;
    buffers.triangle_capacity = triangles;
    buffers.positions = vertices ? &mesh->positions[0].x : nullptr;
    buffers.normals = vertices ? &mesh->normals[0].x : nullptr;
    buffers.colours = vertices && colour ? mesh->colours[0].data() : nullptr;
    buffers.triangles = triangles ? mesh->triangles[0].data() : nullptr;
    if (vertices == 0) return {};
    BURIN_TRY(status_of(burin_mesh(map, &flags.options, &buffers), map));
    return remove_small(flags, mesh);
}

OwnedMap::~OwnedMap() {
    burin_destroy(&map_);
    if (memory_) munmap(memory_, bytes_);
}

Status OwnedMap::create(const burin_config& config) {
    BURIN_TRY(status_of(burin_bytes(&config, &bytes_), burin_map{0, 0}));
    // Pages that are never touched cost nothing, so a large budget is no burden for a small scene.
    void* memory =
        mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (memory == MAP_FAILED)
        return Status::error(Code::insufficient_memory, "--budget: the system does not give %llu bytes",
                             static_cast<unsigned long long>(bytes_));
    memory_ = memory;
    // A chunk is half a page, so every other one misses the processor's table of pages: with large pages
    // integration is 5 to 10 % faster. Where the system has none, this does nothing.
    madvise(memory_, bytes_, MADV_HUGEPAGE);
    return status_of(burin_create(&config, memory_, bytes_, &map_), burin_map{0, 0});
}

Status OwnedMap::open(const std::string& path, unsigned threads, PlanesWanted planes) {
    burin_file_info info;
    BURIN_TRY(status_of(burin_file_probe(path.c_str(), &info), burin_map{0, 0}));
    info.config.budget_bytes = info.least_budget_bytes;
    info.config.threads = threads;
    if (planes == PlanesWanted::off) info.config.planes = 0;
    if (planes == PlanesWanted::on) {
        // The layer takes 5 MiB for outlines and the like, and for each chunk half a chunk's geometry and
        // tables: 0.6 of a map without colour. It has room for half as many chunks as the map, and what
        // planes complete lies where the map has none. Pages that are not used cost nothing.
        info.config.planes = 1;
        info.config.budget_bytes += info.config.budget_bytes + (8u << 20);
    }
    BURIN_TRY(create(info.config));
    return status_of(burin_load(map_, path.c_str()), map_);
}

Status prepare_folder(const std::string& path) {
    std::error_code error;
    std::filesystem::create_directories(path, error);
    if (error)
        return Status::error(Code::io, "%s: cannot create the folder: %s", path.c_str(),
                             error.message().c_str());
    if (access(path.c_str(), W_OK) != 0 || !std::filesystem::is_directory(path))
        return Status::error(Code::io, "%s: cannot write here: %s", path.c_str(), std::strerror(errno));
    return {};
}

Status write_json(const std::string& path, const nlohmann::json& json) {
    const std::string text = json.dump(2) + "\n";
    return write_file_atomically(path.c_str(), text.data(), text.size());
}

bool is_map_file(const std::string& path) {
    char magic[8] = {};
    std::ifstream file(path, std::ios::binary);
    return file.read(magic, sizeof magic) && std::memcmp(magic, "BURINMAP", 8) == 0;
}

}  // namespace burin::cli
