// SPDX-License-Identifier: MIT
#include "suite/output.h"

#include <cstdio>
#include <fstream>
#include <sstream>

namespace burin::bench {
namespace {

constexpr const char* kColumns = "machine,commit,run,dataset,program,voxel_mm,threads,colour,metric,value";

// What issue 3 asks for. `least`: the figure is to be at least this, otherwise at most.
struct Aim {
    const char *key, *text;
    bool least;
    double value;
};
constexpr Aim kAims[] = {
    {"integrate_10mm_vs_o3d_vbg", "integration, 10 mm: times faster than Open3D VoxelBlockGrid", true, 30},
    {"integrate_5mm_vs_o3d_vbg", "integration, 5 mm: times faster than Open3D VoxelBlockGrid", true, 30},
    {"integrate_10mm_vs_o3d_legacy", "integration, 10 mm: times faster than Open3D ScalableTSDFVolume", true,
     20},
    {"integrate_5mm_vs_o3d_legacy", "integration, 5 mm: times faster than Open3D ScalableTSDFVolume", true,
     20},
    {"integrate_5mm_vs_bandwidth", "integration, 5 mm: times the bandwidth time", false, 5},
    {"colour_vs_depth", "with colour: times depth only, 5 mm", false, 1.6},
    {"threads2_vs_1", "two threads: times faster than one, 5 mm", true, 1.7},
    {"mesh_full_vs_o3d", "full mesh, 5 mm: times faster than the faster of Open3D's", true, 4},
    {"mesh_incremental_vs_integrate", "incremental mesh, 5 mm: part of the integration time", false, 1.0 / 3},
    {"fps_5mm_2threads", "frames/s, 640x480, 5 mm, two threads, incremental mesh", true, 60},
    {"fps_5mm_2threads_colour", "the same with colour", true, 0},
};

std::string text_of(double value) {
    char text[40];
    std::snprintf(text, sizeof text, "%.4g", value);
    return text;
}

class Rows {
  public:
    explicit Rows(const Options& o)
        : start_(o.machine + "," + o.commit + "," + (o.quick ? "quick" : "full") + ",") {}
    const std::string& start() const { return start_; }
    void add(const std::string& about, const std::string& metric, const Json& value) {
        if (value.is_number())
            text_ += start_ + about + "," + metric + "," + text_of(value.get<double>()) + "\n";
    }
    const std::string& text() const { return text_; }

  private:
    std::string start_, text_;
};

std::string about_of(const Subject& s) {
    return s.dataset + "," + s.program + "," + std::to_string(s.voxel_mm) + "," + std::to_string(s.threads) +
           "," + (s.colour ? "1" : "0");
}

}  // namespace

bool write_text(const std::string& path, const std::string& text) {
    std::ofstream file(path, std::ios::binary);
    file << text;
    file.close();
    if (!file) std::fprintf(stderr, "suite: %s: cannot be written\n", path.c_str());
    return static_cast<bool>(file);
}

bool write_csv(const std::string& path, const Options& options, const Json& report) {
    Rows rows(options);
    for (const auto& [dataset, entry] : report["datasets"].items()) {
        for (const auto& [key, value] : entry["ratios"].items()) rows.add(dataset + ",ratio,,,", key, value);
        for (const auto& [name, job] : entry["jobs"].items()) {
            const Subject s = {dataset, job["program"], job["voxel_mm"], job["threads"], job["colour"]};
            const bool incremental = name.find("-incremental") != std::string::npos;
            for (const auto& [key, value] : job["figures"].items())
                rows.add(about_of(s), incremental ? "incremental_" + key : key, value);
        }
        if (entry.contains("coverage"))
            for (const auto& [key, value] : entry["coverage"].items())
                rows.add(dataset + ",coverage,,,", key, value);
    }
    for (const char* part : {"ratios", "memory", "machine_figures", "kernels_ns", "roofline"})
        if (report.contains(part))
            for (const auto& [key, value] : report[part].items())
                rows.add(std::string(",") + part + ",,,", key, value);

    std::string text = std::string(kColumns) + "\n";
    std::ifstream old(path);
    for (std::string line; std::getline(old, line);)
        if (line != kColumns && line.rfind(rows.start(), 0) != 0) text += line + "\n";
    return write_text(path, text + rows.text());
}

std::string table_of(const Options& options, const Json& report) {
    std::ostringstream out;
    out << "Machine `" << options.machine << "`, commit " << options.commit << ", "
        << (options.quick ? "`./dev bench --quick`" : "`./dev bench`")
        << "; the least favourable of the data sets ";
    const char* comma = "";
    for (const auto& [dataset, entry] : report["datasets"].items()) {
        out << comma << "`" << dataset << "` (" << entry["frames"].get<std::string>() << ")";
        comma = ", ";
    }
    out << ".\n\n| | measured | aim |\n|---|---|---|\n";
    for (const Aim& aim : kAims) {
        const Json value = report["ratios"].value(aim.key, Json());
        out << "| " << aim.text << " | " << (value.is_number() ? text_of(value.get<double>()) : "not run")
            << " | ";
        if (aim.value > 0) out << (aim.least ? "at least " : "at most ") << text_of(aim.value);
        out << " |\n";
    }
    if (report.contains("memory"))
        for (const auto& [key, value] : report["memory"].items())
            out << "| " << key << " | " << text_of(value.get<double>()) << " | |\n";
    out << "\nMedian over frames of the least time over the runs, ms; processor time in brackets.\n\n"
        << "| data set | program | voxel | threads | colour | depth + integrate | of it integrate | "
           "incremental mesh | full "
           "mesh |\n|---|---|---|---|---|---|---|---|---|\n";
    for (const auto& [dataset, entry] : report["datasets"].items())
        for (const auto& [name, job] : entry["jobs"].items()) {
            const Json& f = job["figures"];
            const auto cell = [&](const char* key, const char* cpu) {
                if (!f.contains(key)) return std::string();
                std::string text = text_of(f[key].get<double>());
                if (*cpu && f.contains(cpu)) text += " (" + text_of(f[cpu].get<double>()) + ")";
                return text;
            };
            out << "| `" << dataset << "` | " << job["program"].get<std::string>() << " | " << job["voxel_mm"]
                << " mm | " << job["threads"] << " | " << (job["colour"].get<bool>() ? "yes" : "no") << " | "
                << cell("frame_ms", "frame_cpu_ms") << " | " << cell("integrate_ms", "") << " | "
                << cell("mesh_ms", "mesh_cpu_ms") << " | " << cell("mesh_full_ms", "mesh_full_cpu_ms")
                << " |\n";
        }
    bool coverage = false;
    for (const auto& [dataset, entry] : report["datasets"].items()) {
        if (!entry.contains("coverage")) continue;
        if (!coverage)
            out << "\n| data set | surface | of it within two voxels of the other |\n|---|---|---|\n";
        coverage = true;
        for (const auto& [key, value] : entry["coverage"].items())
            out << "| `" << dataset << "` | " << key << " | " << text_of(100 * value.get<double>())
                << " % |\n";
    }
    return out.str();
}

}  // namespace burin::bench
