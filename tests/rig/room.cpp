// SPDX-License-Identifier: MIT
// rig_room: what the rig has to do on this machine for the whole chain, emulated sensor to mesh.
//     rig_room frames SEQUENCE FILE       a rendered sequence as emulators play it (emulators/picture.h)
//     rig_room place MESH SEQUENCE OUT    a mesh in the first camera's coordinates, moved to where the
//     sequence says that camera was
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "capture/dataset.h"
#include "datasets/open.h"
#include "export/ply.h"

namespace {

using namespace burin;

int fail(const std::string& text) { return std::fprintf(stderr, "rig_room: %s\n", text.c_str()), 1; }

int write_frames(const Dataset& sequence, const char* path) {
    FILE* file = std::fopen(path, "wb");
    if (file == nullptr) return fail(std::string(path) + ": cannot write");
    Frame frame;
    for (int i = 0; i < sequence.frame_count(); ++i) {
        if (const Status s = sequence.load(i, &frame); !s.ok()) return fail(s.text());
        const auto depth = frame.depth_u16.view();
        const auto colour = frame.colour.view();
        if (i == 0) {
            char header[4096] = "";
            const Camera& c = frame.depth_camera;
            std::snprintf(header, sizeof header, "rig %d %d %d %d %d %.6f %.6f %.6f %.6f\n",
                          sequence.frame_count(), depth.width, depth.height, colour.width, colour.height,
                          c.fx, c.fy, c.cx, c.cy);
            std::fwrite(header, 1, sizeof header, file);
        }
        std::vector<std::uint8_t> row;
        for (int y = 0; y < depth.height; ++y) {
            row.clear();
            for (int x = 0; x < depth.width; ++x) {
                const double mm = std::round(1000 * frame.depth_unit_m * depth.at(x, y));
                const int v = mm > 0 && mm < 65535 ? static_cast<int>(mm) : 0;
                row.push_back(static_cast<std::uint8_t>(v)), row.push_back(static_cast<std::uint8_t>(v >> 8));
            }
            std::fwrite(row.data(), 1, row.size(), file);
        }
        for (int y = 0; y < colour.height; ++y)
            std::fwrite(&colour.at(0, y), 1, 3 * static_cast<std::size_t>(colour.width), file);
    }
    // A block device has whole sectors.
    const std::vector<std::uint8_t> end(4096 - static_cast<std::size_t>(std::ftell(file)) % 4096, 0);
    std::fwrite(end.data(), 1, end.size(), file);
    if (std::ferror(file) != 0 || std::fclose(file) != 0) return fail(std::string(path) + ": cannot write");
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    const std::string verb = argc > 1 ? argv[1] : "";
    const bool frames = verb == "frames" && argc == 4, place = verb == "place" && argc == 5;
    if (!frames && !place) return fail("expected: frames SEQUENCE FILE, or: place MESH SEQUENCE OUT");
    const auto sequence = open_dataset(argv[frames ? 2 : 3], "");
    if (!sequence.ok()) return fail(sequence.status().text());
    if (frames) return write_frames(**sequence, argv[3]);
    Frame first;
    if (const Status s = (*sequence)->load(0, &first); !s.ok()) return fail(s.text());
    auto read = read_ply(argv[2]);
    if (!read.ok()) return fail(read.status().text());
    TriangleMesh& mesh = *read;
    const Se3& T = first.T_world_camera;
    const auto moved = [](const Vec3d& v) {
        return Vec3f{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
    };
    for (Vec3f& p : mesh.positions) p = moved(T * Vec3d{p.x, p.y, p.z});
    for (Vec3f& n : mesh.normals) n = moved(T.R * Vec3d{n.x, n.y, n.z});
    if (const Status s = write_ply(argv[4], mesh); !s.ok()) return fail(s.text());
    return 0;
}
