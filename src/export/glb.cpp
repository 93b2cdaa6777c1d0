// SPDX-License-Identifier: MIT
#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <ostream>
#include <streambuf>

#include "export/block_writer.h"
#include "export/mesh_file.h"

namespace burin {
namespace {

// Lets the glTF library write into the atomic file.
class BlockStream : public std::streambuf {
  public:
    explicit BlockStream(BlockWriter& out) : out_(out) {}

  protected:
    std::streamsize xsputn(const char* data, std::streamsize count) override {
        out_.bytes(data, static_cast<std::size_t>(count));
        return out_.failed() ? 0 : count;
    }
    int_type overflow(int_type c) override {
        if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
        const char byte = traits_type::to_char_type(c);
        return xsputn(&byte, 1) == 1 ? c : traits_type::eof();
    }

  private:
    BlockWriter& out_;
};

Vec3f y_up(Vec3f v) { return {v.x, v.z, -v.y}; }

// sRGB (IEC 61966-2-1) to linear light, 16 bits.
std::array<std::uint16_t, 256> linear_light() {
    std::array<std::uint16_t, 256> table{};
    for (int i = 0; i < 256; ++i) {
        const double s = i / 255.0;
        const double linear = s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
        table[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(std::lround(65535 * linear));
    }
    return table;
}

// Appends an array to the one buffer as a view of its own. Returns the new accessor.
template <class T>
int add_array(tinygltf::Model& model, const std::vector<T>& values, int component, int type, int target) {
    auto& bytes = model.buffers[0].data;
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = bytes.size();  // every element here is a multiple of 4 bytes, so offsets stay aligned
    view.byteLength = values.size() * sizeof(T);
    view.target = target;
    static_assert(sizeof(T) % 4 == 0);
    bytes.resize(bytes.size() + view.byteLength);
    std::memcpy(bytes.data() + view.byteOffset, values.data(), view.byteLength);
    model.bufferViews.push_back(view);

    tinygltf::Accessor accessor;
    accessor.bufferView = static_cast<int>(model.bufferViews.size()) - 1;
    accessor.componentType = component;
    accessor.type = type;
    accessor.count = values.size();
    model.accessors.push_back(accessor);
    return static_cast<int>(model.accessors.size()) - 1;
}

tinygltf::Primitive make_primitive(tinygltf::Model& model, const TriangleMesh& mesh) {
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    primitive.material = 0;

    std::vector<Vec3f> vectors(mesh.positions.size());
    std::transform(mesh.positions.begin(), mesh.positions.end(), vectors.begin(), y_up);
    const int position = add_array(model, vectors, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3,
                                   TINYGLTF_TARGET_ARRAY_BUFFER);
    Vec3f low = vectors[0], high = vectors[0];
    for (const Vec3f& p : vectors)
        for (int i = 0; i < 3; ++i) {
            low[i] = std::min(low[i], p[i]);
            high[i] = std::max(high[i], p[i]);
        }
    model.accessors[static_cast<std::size_t>(position)].minValues = {low.x, low.y, low.z};
    model.accessors[static_cast<std::size_t>(position)].maxValues = {high.x, high.y, high.z};
    primitive.attributes["POSITION"] = position;

    if (!mesh.normals.empty()) {
        std::transform(mesh.normals.begin(), mesh.normals.end(), vectors.begin(), y_up);
        primitive.attributes["NORMAL"] = add_array(model, vectors, TINYGLTF_COMPONENT_TYPE_FLOAT,
                                                   TINYGLTF_TYPE_VEC3, TINYGLTF_TARGET_ARRAY_BUFFER);
    }
    if (!mesh.colours.empty()) {
        const auto linear = linear_light();
        // Four channels: elements must begin on multiples of 4 bytes.
        std::vector<std::array<std::uint16_t, 4>> colours(mesh.colours.size());
        for (std::size_t i = 0; i < colours.size(); ++i)
            colours[i] = {linear[mesh.colours[i][0]], linear[mesh.colours[i][1]], linear[mesh.colours[i][2]],
                          65535};
        const int accessor = add_array(model, colours, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT,
                                       TINYGLTF_TYPE_VEC4, TINYGLTF_TARGET_ARRAY_BUFFER);
        model.accessors[static_cast<std::size_t>(accessor)].normalized = true;
        primitive.attributes["COLOR_0"] = accessor;
    }
    std::vector<std::uint32_t> indices(3 * mesh.triangles.size());
    for (std::size_t i = 0; i < indices.size(); ++i) indices[i] = mesh.triangles[i / 3][i % 3];
    primitive.indices = add_array(model, indices, TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, TINYGLTF_TYPE_SCALAR,
                                  TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
    return primitive;
}

tinygltf::Model make_model(const TriangleMesh& mesh) {
    tinygltf::Model model;
    model.asset.version = "2.0";
    model.asset.generator = "Burin";
    tinygltf::Scene scene;
    // glTF has no empty accessors: a mesh without triangles is a scene without nodes.
    if (!mesh.triangles.empty()) {
        model.buffers.resize(1);
        tinygltf::Material material;  // scanned surfaces: not metal, not glossy
        material.pbrMetallicRoughness.metallicFactor = 0;
        material.pbrMetallicRoughness.roughnessFactor = 1;
        model.materials.push_back(material);
        tinygltf::Mesh out;
        out.primitives.push_back(make_primitive(model, mesh));
        model.meshes.push_back(out);
        tinygltf::Node node;
        node.mesh = 0;
        model.nodes.push_back(node);
        scene.nodes.push_back(0);
    }
    model.scenes.push_back(scene);
    model.defaultScene = 0;
    return model;
}

}  // namespace

Status write_glb(const std::string& path, const TriangleMesh& mesh) try {
    BURIN_TRY(check_mesh(mesh));
    // Bytes of the arrays above, and room for the JSON; the container counts in 32 bits.
    const std::uint64_t vertex_bytes =
        12u + (mesh.normals.empty() ? 0 : 12u) + (mesh.colours.empty() ? 0 : 8u);
    const std::uint64_t bytes = vertex_bytes * mesh.positions.size() + 12ull * mesh.triangles.size() + 65536;
    if (bytes > 0xffffffffu)
        return Status::error(Code::unsupported, "cannot write '%s': GLB of %llu bytes, expected below 4 GiB",
                             path.c_str(), static_cast<unsigned long long>(bytes));
    BlockWriter out;
    BURIN_TRY(out.open(path));
    const tinygltf::Model model = make_model(mesh);
    BlockStream buffer(out);
    std::ostream stream(&buffer);
    tinygltf::TinyGLTF writer;
    const bool written = writer.WriteGltfSceneToStream(&model, stream, false, true);
    if (!written && !out.failed())
        return Status::error(Code::io, "cannot write '%s': the glTF library failed", path.c_str());
    return out.finish();
} catch (const std::exception& error) {
    return Status::error(Code::insufficient_memory, "cannot write '%s': %s", path.c_str(), error.what());
}

}  // namespace burin
