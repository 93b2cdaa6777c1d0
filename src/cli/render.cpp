// SPDX-License-Identifier: MIT
// burin render: a picture of a map (by ray casting) or of a mesh (by its triangles).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <thread>

#include "cli/common.h"
#include "core/jobs.h"
#include "datasets/image_file.h"
#include "datasets/trajectory_file.h"
#include "eval/render.h"
#include "export/ply.h"

namespace burin::cli {
namespace {

struct Options {
    std::string input, output, mode = "shaded-colour", size = "1280x960", pose, trajectory, up = "z";
    int frame = 0;
    double fov_deg = 60;
    bool cull = false, quiet = false;
    unsigned threads = std::max(1u, std::thread::hardware_concurrency());
    MeshFlags mesh;
};

bool mode_of(const std::string& text, RenderMode* mode) {
    static constexpr struct {
        const char* name;
        RenderMode mode;
    } kModes[] = {{"shaded", RenderMode::shaded},
                  {"shaded-colour", RenderMode::shaded_colour},
                  {"colour", RenderMode::colour},
                  {"normals", RenderMode::normals},
                  {"depth", RenderMode::depth}};
    for (const auto& known : kModes)
        if (text == known.name) {
            *mode = known.mode;
            return true;
        }
    return false;
}

// The camera: a given pose, a frame of a trajectory, or an overview of the mesh.
Status viewpoint(const Options& o, const TriangleMesh& mesh, int width, int height, Viewpoint* view) {
    const double focal = width / (2 * std::tan(o.fov_deg * 3.14159265358979 / 360));
    view->camera = {width, height, focal, focal, (width - 1) / 2.0, (height - 1) / 2.0};
    view->cull_back_faces = o.cull;
    if (!o.pose.empty()) {
        const auto parsed = parse_tum_trajectory("0 " + o.pose + "\n", "--pose");
        if (!parsed.ok()) return parsed.status();
        view->T_world_camera = parsed->front().T_world_camera;
        return {};
    }
    if (!o.trajectory.empty()) {
        const auto trajectory = read_tum_trajectory(o.trajectory);
        if (!trajectory.ok()) return trajectory.status();
        if (o.frame < 0 || o.frame >= static_cast<int>(trajectory->size()))
            return Status::error(Code::invalid_argument, "--frame: %d, expected 0 to %zu (%s)", o.frame,
                                 trajectory->size() - 1, o.trajectory.c_str());
        view->T_world_camera = (*trajectory)[static_cast<std::size_t>(o.frame)].T_world_camera;
        return {};
    }
    static constexpr struct {
        const char* name;
        Vec3d up;
    } kUps[] = {{"x", {1, 0, 0}},   {"y", {0, 1, 0}},   {"z", {0, 0, 1}},
                {"-x", {-1, 0, 0}}, {"-y", {0, -1, 0}}, {"-z", {0, 0, -1}}};
    for (const auto& known : kUps)
        if (o.up == known.name) {
            const auto found = view_for(mesh, width, height, known.up);
            if (!found.ok()) return found.status();
            *view = *found;
            view->cull_back_faces |= o.cull;
            return {};
        }
    return Status::error(Code::invalid_argument, "--up: '%s', expected x, y, z, -x, -y or -z", o.up.c_str());
}

// Ray casts the map and paints in the same manner as a mesh is painted.
Status raycast_picture(burin_map map, const Viewpoint& view, RenderMode mode, Image<std::uint8_t>* out) {
    const Camera& c = view.camera;
    const std::size_t n = static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height);
    std::vector<float> depth(n), normals(3 * n);
    *out = Image<std::uint8_t>(c.width, c.height, 3, 255);
    std::vector<std::uint8_t> rgb(3 * n);
    const burin_camera camera = {static_cast<std::uint32_t>(c.width),
                                 static_cast<std::uint32_t>(c.height),
                                 c.fx,
                                 c.fy,
                                 c.cx,
                                 c.cy,
                                 0,
                                 0,
                                 0,
                                 0,
                                 0};
    const Quaternion q = quaternion_of(view.T_world_camera.R);
    const Vec3d t = view.T_world_camera.t;
    const burin_pose pose = {t.x, t.y, t.z, q.x, q.y, q.z, q.w};
    BURIN_TRY(status_of(burin_raycast(map, &camera, &pose, depth.data(), normals.data(), rgb.data()), map));
    float near_m = 1e9f, far_m = 0;
    for (const float d : depth)
        if (d > 0) {
            near_m = std::min(near_m, d);
            far_m = std::max(far_m, d);
        }
    for (std::size_t i = 0; i < n; ++i) {
        if (depth[i] <= 0) continue;
        const int x = static_cast<int>(i % static_cast<std::size_t>(c.width)),
                  y = static_cast<int>(i / static_cast<std::size_t>(c.width));
        const Vec3d ray = normalised(view.T_world_camera.R *
                                     unproject(c, {static_cast<double>(x), static_cast<double>(y)}));
        const double facing =
            std::fabs(ray.x * normals[3 * i] + ray.y * normals[3 * i + 1] + ray.z * normals[3 * i + 2]);
        for (std::size_t k = 0; k < 3; ++k) {
            double value = 0;
            switch (mode) {
                case RenderMode::shaded:
                    value = 220 * (0.25 + 0.75 * facing);
                    break;
                case RenderMode::shaded_colour:
                    value = rgb[3 * i + k] * (0.35 + 0.65 * facing);
                    break;
                case RenderMode::colour:
                    value = rgb[3 * i + k];
                    break;
                case RenderMode::normals:
                    value = 127.5 + 127.5 * normals[3 * i + k];
                    break;
                case RenderMode::depth:
                    value = 255 - 225 * (depth[i] - near_m) / std::max(far_m - near_m, 1e-6f);
                    break;
            }
            out->pixels[3 * i + k] = static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
        }
    }
    return {};
}

int run(const Options& o) {
    RenderMode mode;
    if (!mode_of(o.mode, &mode))
        return complain(kBadInput,
                        "--mode: '" + o.mode + "', expected shaded, shaded-colour, colour, normals or depth");
    int width = 0, height = 0;
    if (std::sscanf(o.size.c_str(), "%dx%d", &width, &height) != 2 || width < 1 || height < 1 ||
        width > kMaxImageSide || height > kMaxImageSide)
        return complain(kBadInput, "--size: '" + o.size + "', expected WIDTHxHEIGHT");
    if (!(o.fov_deg > 1 && o.fov_deg < 160)) return complain(kBadInput, "--fov: expected 1 to 160 degrees");

    const bool from_map = is_map_file(o.input);
    OwnedMap map;
    TriangleMesh mesh;
    const bool overview = o.pose.empty() && o.trajectory.empty();
    if (from_map) {
        if (const Status status = map.open(o.input, o.threads); !status.ok()) return complain_input(status);
        // The overview is chosen by the surface, so it has to be extracted; from a pose the rays are enough.
        if (overview)
            if (const Status status = extract_mesh(map.get(), o.mesh, true, &mesh); !status.ok())
                return complain_input(status);
    } else {
        auto read = read_ply(o.input);
        if (!read.ok()) return complain_input(read.status());
        mesh = std::move(*read);
    }
    Viewpoint view;
    if (const Status status = viewpoint(o, mesh, width, height, &view); !status.ok())
        return complain_input(status);

    Image<std::uint8_t> picture;
    if (from_map && !view.cull_back_faces) {
        if (const Status status = raycast_picture(map.get(), view, mode, &picture); !status.ok())
            return complain_input(status);
    } else {
        Jobs jobs(static_cast<int>(o.threads));
        RenderOptions options;
        options.mode = mode;
        options.cull_back_faces = view.cull_back_faces;
        auto rendered = render_mesh(mesh, view.camera, view.T_world_camera, options, jobs);
        if (!rendered.ok()) return complain_input(rendered.status());
        picture = std::move(*rendered);
    }
    if (const Status status = write_png(o.output, static_cast<View<const std::uint8_t>>(picture.view()));
        !status.ok())
        return complain_output(status);
    if (!o.quiet) std::printf("%s: %dx%d, %s\n", o.output.c_str(), width, height, o.mode.c_str());
    return kDone;
}

}  // namespace

void add_render(CLI::App& app, int* exit) {
    auto* command =
        app.add_subcommand("render", "Draw a map (by ray casting) or a mesh (PLY) to a PNG picture");
    auto o = std::make_shared<Options>();
    command->add_option("input", o->input, "a map.burin or a mesh.ply")->required();
    command->add_option("-o,--output", o->output, "PNG file")->required();
    command->add_option("--mode", o->mode, "shaded, shaded-colour, colour, normals or depth")
        ->capture_default_str();
    command->add_option("--size", o->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
    command->add_option("--pose", o->pose, "camera pose \"tx ty tz qx qy qz qw\" (default: an overview)");
    command->add_option("--trajectory", o->trajectory, "TUM trajectory to take the pose from, with --frame");
    command->add_option("--frame", o->frame, "pose of the trajectory")->capture_default_str();
    command->add_option("--fov", o->fov_deg, "horizontal field of view for a given pose, degrees")
        ->capture_default_str();
    command->add_option("--up", o->up, "up axis of the world, for the overview: x, y, z, -x, -y or -z")
        ->capture_default_str();
    command->add_flag("--cull", o->cull,
                      "do not draw surfaces seen from behind (a mesh is drawn, also of a map)");
    command->add_option("--threads", o->threads, "worker threads")->capture_default_str();
    command->add_flag("--quiet", o->quiet, "print nothing");
    o->mesh.add_to(*command);
    command->callback([o, exit] { *exit = run(*o); });
}

}  // namespace burin::cli
