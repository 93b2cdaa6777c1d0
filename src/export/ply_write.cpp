// SPDX-License-Identifier: MIT
#include <cstdio>

#include "export/block_writer.h"
#include "export/mesh_file.h"
#include "export/ply.h"

namespace burin {

Status write_ply(const std::string& path, const TriangleMesh& mesh) {
    BURIN_TRY(check_mesh(mesh));
    BlockWriter out;
    BURIN_TRY(out.open(path));
    char line[80];
    out.text("ply\nformat binary_little_endian 1.0\ncomment Burin: metres, world frame of the data set\n");
    out.text("comment label: 0 none 1 wall 2 floor 3 ceiling 4 table 5 seat 6 window 7 door\n");
    std::snprintf(line, sizeof line, "element vertex %zu\n", mesh.positions.size());
    out.text(line);
    out.text("property float x\nproperty float y\nproperty float z\n");
    if (!mesh.normals.empty()) out.text("property float nx\nproperty float ny\nproperty float nz\n");
    if (!mesh.colours.empty()) out.text("property uchar red\nproperty uchar green\nproperty uchar blue\n");
    std::snprintf(line, sizeof line, "element face %zu\n", mesh.triangles.size());
    out.text(line);
    out.text("property list uchar int vertex_indices\nproperty uchar label\n");
    if (!mesh.filled.empty()) out.text("property uchar filled\n");
    out.text("end_header\n");

    for (std::size_t i = 0; i < mesh.positions.size() && !out.failed(); ++i) {
        out.value(mesh.positions[i]);
        if (!mesh.normals.empty()) out.value(mesh.normals[i]);
        if (!mesh.colours.empty()) out.value(mesh.colours[i]);
    }
    for (std::size_t i = 0; i < mesh.triangles.size() && !out.failed(); ++i) {
        out.value(std::uint8_t{3});
        out.value(mesh.triangles[i]);
        out.value(mesh.labels.empty() ? std::uint8_t{0} : mesh.labels[i]);
        if (!mesh.filled.empty()) out.value(mesh.filled[i]);
    }
    return out.finish();
}

}  // namespace burin
