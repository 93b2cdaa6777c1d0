// SPDX-License-Identifier: MIT
#include <charconv>

#include "export/block_writer.h"
#include "export/mesh_file.h"

namespace burin {
namespace {

// One line of text; 400 bytes hold seven numbers of the longest form many times over.
class Line {
  public:
    explicit Line(const char* keyword) {
        while (*keyword) character(*keyword++);
    }
    template <class Number>
    void number(char before, Number n) {
        character(before);
        length_ =
            static_cast<std::size_t>(std::to_chars(text_ + length_, text_ + sizeof text_, n).ptr - text_);
    }
    void vector(Vec3f v) {
        for (int i = 0; i < 3; ++i) number(' ', v[i]);
    }
    void character(char c) {
        if (length_ < sizeof text_) text_[length_++] = c;
    }
    void write(BlockWriter& out) {
        character('\n');
        out.bytes(text_, length_);
    }

  private:
    char text_[400];
    std::size_t length_ = 0;
};

}  // namespace

Status write_obj(const std::string& path, const TriangleMesh& mesh) {
    BURIN_TRY(check_mesh(mesh));
    BlockWriter out;
    BURIN_TRY(out.open(path));
    out.text("# Burin: metres, world frame of the data set\n");
    for (std::size_t i = 0; i < mesh.positions.size() && !out.failed(); ++i) {
        Line line("v");
        line.vector(mesh.positions[i]);
        if (!mesh.colours.empty())  // 4 digits tell the 256 steps apart
            for (const std::uint8_t c : mesh.colours[i])
                line.number(' ', std::uint32_t{(c * 10000u + 127) / 255} / 1e4f);
        line.write(out);
    }
    for (std::size_t i = 0; i < mesh.normals.size() && !out.failed(); ++i) {
        Line line("vn");
        line.vector(mesh.normals[i]);
        line.write(out);
    }
    for (std::size_t i = 0; i < mesh.triangles.size() && !out.failed(); ++i) {
        Line line("f");
        for (const std::uint32_t v : mesh.triangles[i]) {
            line.number(' ', v + 1);  // OBJ counts from 1
            if (mesh.normals.empty()) continue;
            line.character('/');  // v//vn: the empty field between is the texture coordinate
            line.number('/', v + 1);
        }
        line.write(out);
    }
    return out.finish();
}

}  // namespace burin
