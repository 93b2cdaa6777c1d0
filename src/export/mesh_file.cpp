// SPDX-License-Identifier: MIT
#include "export/mesh_file.h"

#include "export/ply.h"

namespace burin {

Status write_mesh(const std::string& path, const TriangleMesh& mesh) {
    const std::size_t dot = path.find_last_of("./");
    std::string extension = dot == std::string::npos || path[dot] == '/' ? std::string() : path.substr(dot);
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    if (extension == ".ply") return write_ply(path, mesh);
    if (extension == ".obj") return write_obj(path, mesh);
    if (extension == ".stl") return write_stl(path, mesh);
    if (extension == ".glb") return write_glb(path, mesh);
    return Status::error(Code::unsupported,
                         "cannot write '%s': extension '%s', expected .ply, .obj, .stl or .glb", path.c_str(),
                         extension.c_str());
}

}  // namespace burin
