// SPDX-License-Identifier: MIT
#include "export/block_writer.h"
#include "export/mesh_file.h"

namespace burin {

Status write_stl(const std::string& path, const TriangleMesh& mesh) {
    BURIN_TRY(check_mesh(mesh));
    BlockWriter out;
    BURIN_TRY(out.open(path));
    // 80 free bytes; they must not begin with "solid", by which readers tell the text form.
    char header[80] = "Burin: binary STL, metres";
    out.bytes(header, sizeof header);
    out.value(static_cast<std::uint32_t>(mesh.triangles.size()));
    for (const auto& triangle : mesh.triangles) {
        if (out.failed()) break;
        const Vec3f corner[3] = {mesh.positions[triangle[0]], mesh.positions[triangle[1]],
                                 mesh.positions[triangle[2]]};
        const Vec3d a = to_double(corner[0]);
        out.value(to_float(normalised(cross(to_double(corner[1]) - a, to_double(corner[2]) - a))));
        for (const Vec3f& p : corner) out.value(p);
        out.value(std::uint16_t{0});  // "attribute byte count", unused
    }
    return out.finish();
}

}  // namespace burin
