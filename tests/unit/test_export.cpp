// SPDX-License-Identifier: MIT
// What is written is what was meant: every format read back, GLB and STL by parsers of the test's own.
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "export/mesh_file.h"
#include "export/ply.h"
#include "test_eval_meshes.h"
#include "test_export_files.h"

using namespace burin;
using namespace burin::testing_meshes;
using namespace burin::testing_files;

namespace {

TriangleMesh painted_sphere(int rounds) {
    TriangleMesh mesh = make_sphere(1.5, rounds, {0.25, -3, 7});
    paint(&mesh);
    return mesh;
}

template <class T>
T read_at(const std::string& bytes, std::size_t offset) {
    T value{};
    EXPECT_LE(offset + sizeof(T), bytes.size());
    if (offset + sizeof(T) <= bytes.size()) std::memcpy(&value, bytes.data() + offset, sizeof(T));
    return value;
}

Result<TriangleMesh> parse(const std::string& text) {
    return parse_ply({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, "text.ply");
}

}  // namespace

TEST(Ply, ComesBackBitByBit) {
    Folder folder;
    const TriangleMesh mesh = painted_sphere(6);  // 16386 vertices: over several blocks of the writer
    const std::string path = folder / "mesh.ply";
    ASSERT_TRUE(write_ply(path, mesh).ok());
    EXPECT_EQ(folder.files(), 1u);
    const auto read = read_ply(path);
    ASSERT_TRUE(read.ok()) << read.status().text();
    EXPECT_EQ(read->positions, mesh.positions);
    EXPECT_EQ(read->normals, mesh.normals);
    EXPECT_EQ(read->colours, mesh.colours);
    EXPECT_EQ(read->triangles, mesh.triangles);
    EXPECT_EQ(read->labels, mesh.labels);
    // header + 27 bytes a vertex + 14 a face, nothing else
    const std::string bytes = slurp(path);
    const std::size_t body = bytes.find("end_header\n") + 11;
    EXPECT_EQ(bytes.size() - body, 27 * mesh.positions.size() + 14 * mesh.triangles.size());
}

TEST(Ply, LabelsAreAlwaysThereAndOtherAttributesOnlyWhenKnown) {
    Folder folder;
    TriangleMesh mesh = painted_sphere(1);
    mesh.normals.clear();
    mesh.colours.clear();
    mesh.labels.clear();
    ASSERT_TRUE(write_ply(folder / "bare.ply", mesh).ok());
    const auto read = read_ply(folder / "bare.ply");
    ASSERT_TRUE(read.ok()) << read.status().text();
    EXPECT_EQ(read->positions, mesh.positions);
    EXPECT_EQ(read->triangles, mesh.triangles);
    EXPECT_TRUE(read->normals.empty());
    EXPECT_TRUE(read->colours.empty());
    EXPECT_EQ(read->labels, std::vector<std::uint8_t>(mesh.triangles.size(), 0));
}

TEST(Ply, FilledFacesKeepTheirMarkAndOthersCostNothing) {
    Folder folder;
    TriangleMesh mesh = painted_sphere(1);
    ASSERT_TRUE(write_ply(folder / "seen.ply", mesh).ok());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) mesh.filled.push_back(i % 3 == 0);
    ASSERT_TRUE(write_ply(folder / "filled.ply", mesh).ok());
    const auto seen = read_ply(folder / "seen.ply"), filled = read_ply(folder / "filled.ply");
    ASSERT_TRUE(seen.ok() && filled.ok()) << filled.status().text();
    EXPECT_TRUE(seen->filled.empty());
    EXPECT_EQ(filled->filled, mesh.filled);
    EXPECT_EQ(filled->labels, mesh.labels);
    EXPECT_EQ(filled->triangles, mesh.triangles);

    // A polygon passes its mark on to every triangle of its fan, whatever the order of the properties.
    const auto fan = parse(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 2\nproperty uchar filled\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n1 1 0\n0 1 0\n1 4 0 1 2 3\n0 3 0 1 2\n");
    ASSERT_TRUE(fan.ok()) << fan.status().text();
    EXPECT_EQ(fan->filled, (std::vector<std::uint8_t>{1, 1, 0}));
    EXPECT_TRUE(fan->labels.empty());
}

TEST(Ply, EmptyMeshIsAValidFile) {
    Folder folder;
    ASSERT_TRUE(write_ply(folder / "empty.ply", {}).ok());
    const auto read = read_ply(folder / "empty.ply");
    ASSERT_TRUE(read.ok()) << read.status().text();
    EXPECT_TRUE(read->positions.empty() && read->triangles.empty());
}

TEST(Ply, ReadsAsciiAsMeshLabWritesIt) {
    const auto read = parse(
        "ply\r\nformat ascii 1.0\r\ncomment VCGLIB generated\r\ncomment TextureFile a b\r\nelement vertex "
        "5\r\n"
        "property float x\r\nproperty float y\r\nproperty float z\r\nproperty float nx\r\nproperty float "
        "ny\r\n"
        "property float nz\r\nproperty int flags\r\nproperty uchar red\r\nproperty uchar green\r\n"
        "property uchar blue\r\nproperty uchar alpha\r\nproperty float quality\r\nelement face 2\r\n"
        "property list uchar int vertex_indices\r\nproperty list uchar float texcoord\r\nproperty int "
        "flags\r\n"
        "end_header\r\n"
        "0 0 0 0 0 2 0 255 0 1 255 0.5 \r\n1 0 0 0 0 1 0 9 8 7 255 1e-1\r\n1 1 0 nan nan nan 0 1 2 3 255 "
        "0\r\n"
        "0 +1 0 0 0 1 0 4 5 6 255 0\r\n0 2 -1.5e0 0 1 0 0 10 11 12 255 0\r\n"
        "4 0 1 2 3 6 0 0 1 0 1 1 0\r\n3 3 2 4 0 8\r\n");
    ASSERT_TRUE(read.ok()) << read.status().text();
    ASSERT_EQ(read->positions.size(), 5u);
    EXPECT_EQ(read->positions[4], (Vec3f{0, 2, -1.5f}));
    EXPECT_EQ(read->normals[0], (Vec3f{0, 0, 1}));  // brought to unit length
    EXPECT_EQ(read->normals[2], (Vec3f{0, 0, 0}));  // nan
    EXPECT_EQ(read->colours[1], (std::array<std::uint8_t, 3>{9, 8, 7}));
    const std::vector<std::array<std::uint32_t, 3>> expected = {{0, 1, 2}, {0, 2, 3}, {3, 2, 4}};
    EXPECT_EQ(read->triangles, expected);
    EXPECT_TRUE(read->labels.empty());
}

TEST(Ply, ReadsDoublesUnsignedIndicesAndFacesBeforeVertices) {
    // Open3D writes doubles and `list uchar uint vertex_indices`; the order of elements is free.
    std::string file =
        "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty uint8 label\n"
        "property list uint8 uint32 vertex_index\nelement vertex 3\nproperty float64 z\nproperty float64 x\n"
        "property float64 y\nproperty uint16 blue\nproperty uint16 red\nproperty uint16 green\nend_header\n";
    const auto append = [&](const auto& v) { file.append(reinterpret_cast<const char*>(&v), sizeof v); };
    append(std::uint8_t{3});
    append(std::uint8_t{3});
    for (const std::uint32_t v : {2u, 0u, 1u}) append(v);
    for (int i = 0; i < 3; ++i) {
        for (const double c : {30.0 + i, 10.0 + i, 20.0 + i}) append(c);
        for (const int c : {3, 1, 2}) append(static_cast<std::uint16_t>(c * 257 * 20));
    }
    const auto read = parse(file);
    ASSERT_TRUE(read.ok()) << read.status().text();
    EXPECT_EQ(read->positions[2], (Vec3f{12, 22, 32}));
    EXPECT_EQ(read->colours[0], (std::array<std::uint8_t, 3>{20, 40, 60}));
    EXPECT_EQ(read->triangles[0], (std::array<std::uint32_t, 3>{2, 0, 1}));
    EXPECT_EQ(read->labels, std::vector<std::uint8_t>{3});
}

TEST(Ply, ReadsBigEndianAndFloatColours) {
    std::string file =
        "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty "
        "float z\n"
        "property float r\nproperty float g\nproperty float b\nend_header\n";
    for (const float f : {1.0f, -2.5f, 1e-3f, 0.0f, 0.5f, 1.0f}) {
        char raw[4];
        std::memcpy(raw, &f, 4);
        file.append({raw[3], raw[2], raw[1], raw[0]});
    }
    const auto read = parse(file);
    ASSERT_TRUE(read.ok()) << read.status().text();
    EXPECT_EQ(read->positions[0], (Vec3f{1, -2.5f, 1e-3f}));
    EXPECT_EQ(read->colours[0], (std::array<std::uint8_t, 3>{0, 128, 255}));
    EXPECT_TRUE(read->triangles.empty());
}

TEST(Obj, ReadsBackTheSame) {
    Folder folder;
    const TriangleMesh mesh = painted_sphere(3);
    ASSERT_TRUE(write_obj(folder / "mesh.obj", mesh).ok());
    std::istringstream in(slurp(folder / "mesh.obj"));
    TriangleMesh read;
    for (std::string line; std::getline(in, line);) {
        std::istringstream words(line);
        std::string keyword;
        words >> keyword;
        if (keyword == "v") {
            Vec3f p;
            double c[3];
            words >> p.x >> p.y >> p.z >> c[0] >> c[1] >> c[2];
            read.positions.push_back(p);
            read.colours.push_back({static_cast<std::uint8_t>(std::lround(255 * c[0])),
                                    static_cast<std::uint8_t>(std::lround(255 * c[1])),
                                    static_cast<std::uint8_t>(std::lround(255 * c[2]))});
        } else if (keyword == "vn") {
            Vec3f n;
            words >> n.x >> n.y >> n.z;
            read.normals.push_back(n);
        } else if (keyword == "f") {
            std::array<std::uint32_t, 3> t{};
            for (std::uint32_t& v : t) {
                std::uint32_t normal = 0;
                char slash[2];
                words >> v >> slash[0] >> slash[1] >> normal;
                EXPECT_EQ(slash[0], '/');
                EXPECT_EQ(slash[1], '/');
                EXPECT_EQ(normal, v);
                --v;
            }
            read.triangles.push_back(t);
        } else {
            EXPECT_EQ(keyword, "#");
        }
        EXPECT_FALSE(words.fail()) << line;
    }
    EXPECT_EQ(read.positions, mesh.positions);
    EXPECT_EQ(read.normals, mesh.normals);
    EXPECT_EQ(read.colours, mesh.colours);
    EXPECT_EQ(read.triangles, mesh.triangles);
}

TEST(Stl, HoldsEveryTriangleWithItsNormal) {
    Folder folder;
    const TriangleMesh mesh = painted_sphere(2);
    ASSERT_TRUE(write_stl(folder / "mesh.stl", mesh).ok());
    const std::string bytes = slurp(folder / "mesh.stl");
    ASSERT_EQ(bytes.size(), 84 + 50 * mesh.triangles.size());
    EXPECT_NE(bytes.substr(0, 5), "solid");
    EXPECT_EQ(read_at<std::uint32_t>(bytes, 80), mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        Vec3f sum;
        for (std::size_t k = 0; k < 3; ++k) {
            const auto p = read_at<Vec3f>(bytes, 84 + 50 * i + 12 * (k + 1));
            EXPECT_EQ(p, mesh.positions[mesh.triangles[i][k]]);
            sum = sum + mesh.normals[mesh.triangles[i][k]];
        }
        EXPECT_GT(dot(read_at<Vec3f>(bytes, 84 + 50 * i), normalised(sum)), 0.98f);
    }
}

namespace {

// The parts of a GLB file by the specification (glTF 2.0, section 4), checked as they are taken apart.
struct Glb {
    nlohmann::json json;
    std::string binary;
};

Glb take_apart(const std::string& bytes) {
    Glb glb;
    EXPECT_EQ(bytes.substr(0, 4), "glTF");
    EXPECT_EQ(read_at<std::uint32_t>(bytes, 4), 2u);
    EXPECT_EQ(read_at<std::uint32_t>(bytes, 8), bytes.size());
    const auto json_length = read_at<std::uint32_t>(bytes, 12);
    EXPECT_EQ(json_length % 4, 0u);
    EXPECT_EQ(bytes.substr(16, 4), "JSON");
    glb.json = nlohmann::json::parse(bytes.substr(20, json_length));
    if (20 + json_length == bytes.size()) return glb;
    const auto binary_length = read_at<std::uint32_t>(bytes, 20 + json_length);
    EXPECT_EQ(binary_length % 4, 0u);
    EXPECT_EQ(bytes.substr(24 + json_length, 4), std::string("BIN\0", 4));
    EXPECT_EQ(28 + json_length + binary_length, bytes.size());
    glb.binary = bytes.substr(28 + json_length);
    return glb;
}

// The bytes of an accessor, after checking its type and extent.
std::string accessor(const Glb& glb, int index, int component, const char* type, std::size_t count,
                     std::size_t bytes) {
    const auto& a = glb.json["accessors"][static_cast<std::size_t>(index)];
    EXPECT_EQ(a["componentType"], component);
    EXPECT_EQ(a["type"], type);
    EXPECT_EQ(a["count"], count);
    const auto& view = glb.json["bufferViews"][a["bufferView"].get<std::size_t>()];
    EXPECT_FALSE(view.contains("byteStride"));
    const std::size_t offset =
        view.value("byteOffset", std::size_t{0}) + a.value("byteOffset", std::size_t{0});
    EXPECT_EQ(offset % 4, 0u);
    EXPECT_EQ(view["byteLength"], count * bytes);
    EXPECT_LE(offset + count * bytes, glb.binary.size());
    return glb.binary.substr(offset, count * bytes);
}

}  // namespace

TEST(Glb, IsYUpWithLinearColourAnd32BitIndices) {
    Folder folder;
    const TriangleMesh mesh = painted_sphere(7);  // 65538 vertices: indices over 16 bits
    ASSERT_GT(mesh.positions.size(), 65536u);
    ASSERT_TRUE(write_glb(folder / "mesh.glb", mesh).ok());
    const Glb glb = take_apart(slurp(folder / "mesh.glb"));
    EXPECT_EQ(glb.json["asset"]["version"], "2.0");
    EXPECT_EQ(glb.json["scenes"][glb.json["scene"].get<std::size_t>()]["nodes"], nlohmann::json({0}));
    EXPECT_EQ(glb.json["nodes"][0]["mesh"], 0);
    EXPECT_FALSE(glb.json["nodes"][0].contains("matrix"));
    ASSERT_EQ(glb.json["meshes"].size(), 1u);
    ASSERT_EQ(glb.json["meshes"][0]["primitives"].size(), 1u);
    ASSERT_EQ(glb.json["buffers"].size(), 1u);
    EXPECT_FALSE(glb.json["buffers"][0].contains("uri"));
    const auto& primitive = glb.json["meshes"][0]["primitives"][0];
    EXPECT_EQ(primitive.value("mode", 4), 4);  // triangles
    const auto& attributes = primitive["attributes"];
    const std::size_t n = mesh.positions.size();
    const std::string positions = accessor(glb, attributes["POSITION"], 5126, "VEC3", n, 12);
    const std::string normals = accessor(glb, attributes["NORMAL"], 5126, "VEC3", n, 12);
    const std::string colours = accessor(glb, attributes["COLOR_0"], 5123, "VEC4", n, 8);
    const std::string indices =
        accessor(glb, primitive["indices"], 5125, "SCALAR", 3 * mesh.triangles.size(), 4);
    EXPECT_EQ(glb.json["accessors"][attributes["COLOR_0"].get<std::size_t>()]["normalized"], true);

    Vec3f low{1e9f, 1e9f, 1e9f}, high{-1e9f, -1e9f, -1e9f};
    for (std::size_t i = 0; i < n; ++i) {
        const Vec3f p = mesh.positions[i], m = mesh.normals[i];
        const Vec3f turned = {p.x, p.z, -p.y};
        ASSERT_EQ(read_at<Vec3f>(positions, 12 * i), turned);
        ASSERT_EQ(read_at<Vec3f>(normals, 12 * i), (Vec3f{m.x, m.z, -m.y}));
        for (std::size_t k = 0; k < 3; ++k) {
            // Encoded again, 16-bit linear light is the sRGB byte it came from.
            const double linear = read_at<std::uint16_t>(colours, 8 * i + 2 * k) / 65535.0;
            const double s = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
            ASSERT_EQ(std::lround(255 * s), mesh.colours[i][k]);
        }
        ASSERT_EQ(read_at<std::uint16_t>(colours, 8 * i + 6), 65535);
        for (int k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], turned[k]);
            high[k] = std::max(high[k], turned[k]);
        }
    }
    const auto& bounds = glb.json["accessors"][attributes["POSITION"].get<std::size_t>()];
    for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(bounds["min"][k].get<float>(), low[static_cast<int>(k)]);
        EXPECT_EQ(bounds["max"][k].get<float>(), high[static_cast<int>(k)]);
    }
    for (std::size_t i = 0; i < 3 * mesh.triangles.size(); ++i)
        ASSERT_EQ(read_at<std::uint32_t>(indices, 4 * i), mesh.triangles[i / 3][i % 3]);
}

TEST(Glb, EmptyMeshIsAnEmptyScene) {
    Folder folder;
    ASSERT_TRUE(write_glb(folder / "empty.glb", {}).ok());
    const Glb glb = take_apart(slurp(folder / "empty.glb"));
    EXPECT_EQ(glb.json["asset"]["version"], "2.0");
    EXPECT_EQ(glb.json["scenes"].size(), 1u);
    for (const char* absent : {"meshes", "accessors", "bufferViews", "buffers", "nodes"})
        EXPECT_FALSE(glb.json.contains(absent)) << absent;
}

TEST(MeshFile, FormatFollowsFromTheExtension) {
    Folder folder;
    const TriangleMesh mesh = painted_sphere(1);
    const std::pair<const char*, const char*> expected[] = {
        {"a.ply", "ply\n"}, {"a.PLY", "ply\n"}, {"a.b.obj", "# Bu"}, {"a.stl", "Buri"}, {"a.Glb", "glTF"}};
    for (const auto& [name, start] : expected) {
        ASSERT_TRUE(write_mesh(folder / name, mesh).ok()) << name;
        EXPECT_EQ(slurp(folder / name).substr(0, 4), start) << name;
    }
    for (const char* name : {"mesh.off", "mesh", "folder.ply/mesh", ""}) {
        const Status status = write_mesh(name, mesh);
        EXPECT_EQ(status.code(), Code::unsupported) << name;
        EXPECT_NE(std::strstr(status.text(), "expected .ply"), nullptr) << status.text();
    }
}
