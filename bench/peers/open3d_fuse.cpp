// SPDX-License-Identifier: MIT
// Open3D's fusion of the same frames, for comparison: ScalableTSDFVolume (Zhou & Koltun's, the one its
// reconstruction system uses) or, with --vbg, the VoxelBlockGrid of its tensor library on the CPU. Prints one
// JSON object.
//
// Timed is what Open3D does with a frame that is ready in its own format; reading, decoding, clipping to the
// depth range and bringing colour to the depth pixels are not. Both volumes give every observation the
// weight 1. Open3D 0.16 allocates where every `stride`-th depth pixel in x and y falls (4 by default in both
// volumes, fixed in VoxelBlockGrid) and integrates all pixels.
#include <open3d/camera/PinholeCameraIntrinsic.h>
#include <open3d/core/EigenConverter.h>
#include <open3d/geometry/RGBDImage.h>
#include <open3d/geometry/TriangleMesh.h>
#include <open3d/io/TriangleMeshIO.h>
#include <open3d/pipelines/integration/ScalableTSDFVolume.h>
#include <open3d/t/geometry/VoxelBlockGrid.h>
#include <open3d/utility/Logging.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "peers/open3d_frames.h"

namespace {

namespace core = open3d::core;
namespace geometry = open3d::t::geometry;
using burin::Camera;
using burin::Frame;
using peers::cpu_ms;
using peers::make_ready;
using peers::milliseconds_since;
using peers::Options;
using peers::percentile;
using peers::ReadyFrame;

// Highest resident set so far, bytes.
long long peak_rss_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return 1024LL * usage.ru_maxrss;  // Linux counts in KiB
}

// One of the two volumes of Open3D.
class Volume {
  public:
    virtual ~Volume() = default;
    virtual double integrate_ms(const ReadyFrame& frame) = 0;
    virtual std::shared_ptr<open3d::geometry::TriangleMesh> extract() = 0;
    virtual long long units() = 0;  // allocated blocks of 16^3 voxels
    double last_cpu_ms = 0;         // processor time of the last integrate_ms
};

class Scalable : public Volume {
  public:
    explicit Scalable(const Options& options)
        : volume_(options.voxel_m, options.voxel_m * options.truncation_voxels,
                  options.colour ? ColourType::RGB8 : ColourType::NoColor, 16, options.stride),
          colour_(options.colour) {}

    double integrate_ms(const ReadyFrame& frame) override {
        open3d::geometry::RGBDImage image;
        image.depth_.Prepare(frame.width, frame.height, 1, 4);
        std::memcpy(image.depth_.data_.data(), frame.depth_m.data(), frame.depth_m.size() * 4);
        image.color_.Prepare(frame.width, frame.height, 3, 1);
        if (colour_) std::copy(frame.rgb.begin(), frame.rgb.end(), image.color_.data_.begin());
        const Camera& k = frame.camera;
        const open3d::camera::PinholeCameraIntrinsic intrinsic(frame.width, frame.height, k.fx, k.fy, k.cx,
                                                               k.cy);
        const auto start = std::chrono::steady_clock::now();
        const double cpu_start = cpu_ms();
        volume_.Integrate(image, intrinsic, frame.T_camera_world);
        last_cpu_ms = cpu_ms() - cpu_start;
        return milliseconds_since(start);
    }
    std::shared_ptr<open3d::geometry::TriangleMesh> extract() override {
        return volume_.ExtractTriangleMesh();
    }
    long long units() override { return static_cast<long long>(volume_.volume_units_.size()); }

  private:
    using ColourType = open3d::pipelines::integration::TSDFVolumeColorType;
    open3d::pipelines::integration::ScalableTSDFVolume volume_;
    bool colour_;
};

// Open3D offers two sets of types: 16-bit depth into 16-bit weights and colours, "for SLAM", or floats
// throughout.
class BlockGrid : public Volume {
  public:
    BlockGrid(const Options& options, bool is_u16) : options_(options), is_u16_(is_u16) {
        const core::Dtype small = is_u16 ? core::UInt16 : core::Float32;
        std::vector<std::string> names = {"tsdf", "weight"};
        std::vector<core::Dtype> types = {core::Float32, small};
        std::vector<core::SizeVector> shapes = {{1}, {1}};
        if (options.colour) names.push_back("color"), types.push_back(small), shapes.push_back({3});
        grid_ = geometry::VoxelBlockGrid(names, types, shapes, static_cast<float>(options.voxel_m), 16,
                                         options.blocks);
    }

    double integrate_ms(const ReadyFrame& frame) override {
        const core::SizeVector size = {frame.height, frame.width, 1}, size3 = {frame.height, frame.width, 3};
        geometry::Image depth, colour;
        if (is_u16_)
            depth = core::Tensor(frame.depth_u16, size, core::UInt16);
        else
            depth = core::Tensor(frame.depth_m, size, core::Float32);
        if (options_.colour) colour = core::Tensor(frame.rgb, size3, core::UInt8);
        if (options_.colour && !is_u16_) colour = colour.To(core::Float32);
        const Camera& k = frame.camera;
        const core::Tensor intrinsic =
            core::Tensor::Init<double>({{k.fx, 0, k.cx}, {0, k.fy, k.cy}, {0, 0, 1}});
        const core::Tensor extrinsic = core::eigen_converter::EigenMatrixToTensor(frame.T_camera_world);
        const float scale = is_u16_ ? frame.depth_units_per_m : 1.0f;
        const float max_depth = static_cast<float>(options_.max_depth_m);
        const float truncation = static_cast<float>(options_.truncation_voxels);
        const auto start = std::chrono::steady_clock::now();
        const double cpu_start = cpu_ms();
        const core::Tensor blocks =
            grid_.GetUniqueBlockCoordinates(depth, intrinsic, extrinsic, scale, max_depth, truncation);
        if (options_.colour)
            grid_.Integrate(blocks, depth, colour, intrinsic, extrinsic, scale, max_depth, truncation);
        else
            grid_.Integrate(blocks, depth, intrinsic, extrinsic, scale, max_depth, truncation);
        last_cpu_ms = cpu_ms() - cpu_start;
        return milliseconds_since(start);
    }
    std::shared_ptr<open3d::geometry::TriangleMesh> extract() override {
        return std::make_shared<open3d::geometry::TriangleMesh>(
            grid_.ExtractTriangleMesh(static_cast<float>(options_.min_weight)).ToLegacy());
    }
    long long units() override { return grid_.GetHashMap().Size(); }

  private:
    Options options_;
    bool is_u16_;
    geometry::VoxelBlockGrid grid_;
};

// "A:B" is the half-open range of frames, either end may be missing. False when it is none.
bool parse_range(const std::string& text, int count, int* first, int* last) {
    *first = 0, *last = count;
    if (text.empty()) return true;
    const auto colon = text.find(':');
    if (colon == std::string::npos) return false;
    const std::string a = text.substr(0, colon), b = text.substr(colon + 1);
    if (a.find_first_not_of("0123456789") != std::string::npos || a.size() > 8) return false;
    if (b.find_first_not_of("0123456789") != std::string::npos || b.size() > 8) return false;
    if (!a.empty()) *first = std::stoi(a);
    if (!b.empty()) *last = std::min(count, std::stoi(b));
    return *first < *last;
}

int fail(const std::string& text) {
    std::fprintf(stderr, "open3d_fuse: %s\n", text.c_str());
    return 1;
}

int run(const Options& options) {
    const auto dataset = burin::open_dataset(options.dataset, options.format);
    if (!dataset) return fail(dataset.status().text());
    int first = 0, last = 0;
    if (!parse_range(options.frames, (*dataset)->frame_count(), &first, &last))
        return fail("--frames " + options.frames + ": expected A:B with A < B, within the " +
                    std::to_string((*dataset)->frame_count()) + " frames of the data set");

    std::unique_ptr<Volume> volume;
    const long long rss_before = peak_rss_bytes();  // what the libraries take
    std::vector<double> frame_ms, frame_cpu_ms;
    const auto fuse = [&](const ReadyFrame& ready) {
        if (!volume && options.vbg)
            volume = std::make_unique<BlockGrid>(options, options.colour && !ready.depth_u16.empty());
        else if (!volume)
            volume = std::make_unique<Scalable>(options);
        frame_ms.push_back(volume->integrate_ms(ready));
        frame_cpu_ms.push_back(volume->last_cpu_ms);
    };
    std::vector<ReadyFrame> preloaded;
    ReadyFrame ready;
    for (int i = first; i < last; ++i) {
        Frame frame;
        if (const burin::Status status = (*dataset)->load(i, &frame); !status.ok())
            return fail(status.text());
        if (!frame.has_pose) continue;
        if (const burin::Status status = make_ready(frame, options, &ready); !status.ok())
            return fail(status.text());
        if (options.preload)
            preloaded.push_back(ready);
        else
            fuse(ready);
    }
    for (const ReadyFrame& one : preloaded) fuse(one);
    if (frame_ms.empty()) return fail("no frame has a pose");
    const long long rss_fused = peak_rss_bytes();

    double extract_ms = 0, extract_cpu_ms = 0;
    auto mesh = std::make_shared<open3d::geometry::TriangleMesh>();
    if (options.extract) {
        const auto start = std::chrono::steady_clock::now();
        const double cpu_start = cpu_ms();
        mesh = volume->extract();
        extract_cpu_ms = cpu_ms() - cpu_start;
        extract_ms = milliseconds_since(start);
    }
    const long long rss_extracted = peak_rss_bytes();
    const std::size_t raw_vertices = mesh->vertices_.size(), raw_triangles = mesh->triangles_.size();
    // Open3D repeats vertices where blocks meet; the mesh is written without them, and not timed.
    mesh->RemoveDuplicatedVertices();
    mesh->RemoveDegenerateTriangles();
    if (!options.output.empty() && !open3d::io::WriteTriangleMesh(options.output, *mesh))
        return fail(options.output + ": cannot be written");

    double sum = 0;
    for (const double ms : frame_ms) sum += ms;
    const std::vector<double> in_order = frame_ms;
    std::sort(frame_ms.begin(), frame_ms.end());
    const nlohmann::ordered_json report = {
        {"peer", options.vbg ? "open3d_voxel_block_grid" : "open3d_scalable_tsdf_volume"},
        {"dataset", options.dataset},
        {"frames", frame_ms.size()},
        {"voxel_m", options.voxel_m},
        {"truncation_m", options.voxel_m * options.truncation_voxels},
        {"min_depth_m", options.min_depth_m},
        {"max_depth_m", options.max_depth_m},
        {"allocation_stride", options.vbg ? 4 : options.stride},
        {"threads", options.threads},
        {"colour", options.colour},
        {"frame_ms", in_order},
        {"frame_cpu_ms", frame_cpu_ms},
        {"integrate_p50_ms", percentile(frame_ms, 0.5)},
        {"integrate_mean_ms", sum / static_cast<double>(frame_ms.size())},
        {"integrate_p95_ms", percentile(frame_ms, 0.95)},
        {"extract_ms", extract_ms},
        {"extract_cpu_ms", extract_cpu_ms},
        {"blocks", volume->units()},
        {"rss_before_bytes", rss_before},
        {"rss_fused_bytes", rss_fused},
        {"peak_rss_bytes", rss_extracted},
        {"vertices_extracted", raw_vertices},
        {"triangles_extracted", raw_triangles},
        {"vertices", mesh->vertices_.size()},
        {"triangles", mesh->triangles_.size()},
    };
    std::printf("%s\n", report.dump().c_str());
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    Options options;
    CLI::App app{"Fuses a data set with Open3D and prints its times and memory as JSON"};
    app.add_option("dataset", options.dataset, "folder of the data set")->required();
    app.add_option("--format", options.format, "format of the data set, recognised by default");
    app.add_option("-o,--output", options.output, "mesh to write (.ply)");
    app.add_option("--voxel", options.voxel_m, "edge of a voxel, metres")->check(CLI::Range(1e-4, 1.0));
    app.add_option("--truncation", options.truncation_voxels, "in voxels")->check(CLI::Range(1.0, 64.0));
    app.add_option("--min-depth", options.min_depth_m, "metres")->check(CLI::Range(0.0, 100.0));
    app.add_option("--max-depth", options.max_depth_m, "metres")->check(CLI::Range(0.0, 100.0));
    app.add_option("--min-weight", options.min_weight, "of voxels that make a surface (--vbg)");
    app.add_option("--frames", options.frames, "A:B, half open");
    app.add_option("--stride", options.stride, "allocate at every stride-th pixel")->check(CLI::Range(1, 64));
    app.add_option("--blocks", options.blocks, "room for blocks at first (--vbg)")
        ->check(CLI::Range(1, 10000000));
    app.add_option("--threads", options.threads)->check(CLI::Range(1, 256));
    app.add_flag("--colour", options.colour, "fuse colour too");
    app.add_flag("--vbg", options.vbg, "VoxelBlockGrid instead of ScalableTSDFVolume");
    app.add_flag("--preload", options.preload, "decode all frames before the first is fused");
    app.add_flag("!--no-mesh", options.extract, "leave out the mesh");
    CLI11_PARSE(app, argc, argv);
    peers::start_over_with_threads(options.threads, argv);
    open3d::utility::SetVerbosityLevel(open3d::utility::VerbosityLevel::Warning);
    try {
        return run(options);
    } catch (const std::exception& error) {
        return fail(error.what());
    }
}
