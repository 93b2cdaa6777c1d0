// SPDX-License-Identifier: MIT
#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iterator>

#include "export/ply.h"
#include "export/ply_header.h"

namespace burin {
namespace {

// Hands out the scalars of the body one by one, whatever the encoding.
class Body {
  public:
    Body(std::string_view bytes, PlyEncoding encoding)
        : at_(bytes.data()), end_(at_ + bytes.size()), encoding_(encoding) {}

    std::size_t left() const { return static_cast<std::size_t>(end_ - at_); }

    // False at the end of the data or on text that is no number of this type. Every PLY type fits a double.
    bool next(PlyType type, double* value) {
        if (encoding_ == PlyEncoding::ascii) return next_text(type, value);
        const std::size_t bytes = ply_bytes(type);
        if (left() < bytes) return false;
        unsigned char buffer[8] = {};
        std::memcpy(buffer, at_, bytes);
        at_ += bytes;
        const unsigned char* raw = buffer;
        if (encoding_ == PlyEncoding::big_endian) {
            // All eight, since GCC 12 for aarch64 takes a reversal of some for one that leaves the buffer.
            std::reverse(std::begin(buffer), std::end(buffer));
            raw = std::end(buffer) - bytes;
        }
        switch (type) {
            case PlyType::i8:
                *value = load<std::int8_t>(raw);
                break;
            case PlyType::u8:
                *value = load<std::uint8_t>(raw);
                break;
            case PlyType::i16:
                *value = load<std::int16_t>(raw);
                break;
            case PlyType::u16:
                *value = load<std::uint16_t>(raw);
                break;
            case PlyType::i32:
                *value = load<std::int32_t>(raw);
                break;
            case PlyType::u32:
                *value = load<std::uint32_t>(raw);
                break;
            case PlyType::f32:
                *value = load<float>(raw);
                break;
            case PlyType::f64:
                *value = load<double>(raw);
                break;
        }
        return true;
    }

    // The fewest bytes one scalar can take: in text a digit and the space behind it (the last one has none).
    std::size_t least_bytes(PlyType type) const {
        return encoding_ == PlyEncoding::ascii ? 2 : ply_bytes(type);
    }
    bool can_hold(std::uint64_t count, std::size_t bytes_each) const {
        const std::size_t unwritten =
            encoding_ == PlyEncoding::ascii ? 1 : 0;  // the space behind the last number
        return bytes_each == 0 || count <= (left() + unwritten) / bytes_each;
    }

  private:
    template <class T>
    static double load(const unsigned char* raw) {
        T value;
        std::memcpy(&value, raw, sizeof value);
        return static_cast<double>(value);
    }
    static bool is_space(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }

    bool next_text(PlyType type, double* value) {
        while (at_ != end_ && is_space(*at_)) ++at_;
        if (at_ != end_ && *at_ == '+') ++at_;
        const auto parsed = std::from_chars(at_, end_, *value);
        if (parsed.ec == std::errc::result_out_of_range) {
            // Too small or too large for a double: the sign of the exponent tells which.
            const std::string_view number(at_, static_cast<std::size_t>(parsed.ptr - at_));
            const bool tiny = number.find("e-") != number.npos || number.find("E-") != number.npos;
            *value = tiny ? 0.0 : HUGE_VAL;
        } else if (parsed.ec != std::errc()) {
            return false;
        }
        if (parsed.ptr != end_ && !is_space(*parsed.ptr)) return false;
        at_ = parsed.ptr;
        return ply_is_float(type) || std::nearbyint(*value) == *value;
    }

    static_assert(std::endian::native == std::endian::little);
    const char* at_;
    const char* end_;
    PlyEncoding encoding_;
};

// Where a vertex property goes: position 0..2, normal 3..5, colour 6..8, or nowhere.
int slot_of(const std::string& name) {
    constexpr const char* kNames[][9] = {
        {"x", "y", "z", "nx", "ny", "nz", "red", "green", "blue"},
        {"", "", "", "", "", "", "diffuse_red", "diffuse_green", "diffuse_blue"},
        {"", "", "", "", "", "", "r", "g", "b"}};
    for (const auto& names : kNames)
        for (int i = 0; i < 9; ++i)
            if (name == names[i]) return i;
    return -1;
}

// 8-bit colour from what the file's type means: 16 bit, float 0..1, else 0..255. False when it is none of
// these.
bool colour_from(PlyType type, double value, std::uint8_t* out) {
    if (type == PlyType::u16) value /= 257;  // 65535 -> 255
    if (ply_is_float(type)) value = 255 * std::clamp(value, 0.0, 1.0);
    if (!(value >= 0 && value <= 255)) return false;
    *out = static_cast<std::uint8_t>(std::lround(value));
    return true;
}

class Reader {
  public:
    Reader(const PlyHeader& header, std::string_view bytes, const char* name)
        : header_(header), body_(bytes.substr(header.body), header.encoding), name_(name) {}

    Result<TriangleMesh> read() {
        bool has_vertices = false, has_faces = false, has_strips = false;
        for (const PlyElement& element : header_.elements) {
            has_vertices |= element.name == "vertex";
            has_faces |= element.name == "face";
            has_strips |= element.name == "tristrips";
            if (element.name == "vertex") vertices_ = element.count;
        }
        if (!has_vertices) return Status::error(Code::format, "%s: no 'vertex' element in the header", name_);
        if (has_strips && !has_faces)
            return Status::error(Code::unsupported,
                                 "%s: its surface is 'tristrips', expected an element 'face'", name_);
        for (const PlyElement& element : header_.elements) {
            BURIN_TRY(check_size(element));
            if (element.name == "vertex")
                BURIN_TRY(read_vertices(element));
            else if (element.name == "face")
                BURIN_TRY(read_faces(element));
            else
                BURIN_TRY(skip(element));
        }
        return std::move(mesh_);
    }

  private:
    // Before any memory is reserved: can the rest of the file hold so many?
    Status check_size(const PlyElement& element) const {
        std::size_t least = 0;
        for (const PlyProperty& p : element.properties)
            least += body_.least_bytes(p.is_list ? p.count_type : p.type);
        constexpr std::uint64_t kMaxCount = 0x7fffffff;  // indices are int
        if (element.count > kMaxCount || !body_.can_hold(element.count, least))
            return Status::error(
                Code::format, "%s: %llu of element '%.40s' in the header, but only %zu bytes follow", name_,
                static_cast<unsigned long long>(element.count), element.name.c_str(), body_.left());
        return {};
    }

    Status bad_value(const PlyElement& element, std::uint64_t index, const PlyProperty& property) const {
        return Status::error(Code::format, "%s: '%.40s' of %.40s %llu is missing or no number of its type",
                             name_, property.name.c_str(), element.name.c_str(),
                             static_cast<unsigned long long>(index));
    }

    // Reads the count of a list and checks it against what is left of the file.
    Status list_count(const PlyElement& element, std::uint64_t index, const PlyProperty& property,
                      std::size_t* count) {
        double value = 0;
        if (!body_.next(property.count_type, &value)) return bad_value(element, index, property);
        if (!(value >= 0 && value <= 4294967295.0) ||
            !body_.can_hold(static_cast<std::uint64_t>(value), body_.least_bytes(property.type)))
            return Status::error(Code::format,
                                 "%s: '%.40s' of %.40s %llu has %g entries, but only %zu bytes follow", name_,
                                 property.name.c_str(), element.name.c_str(),
                                 static_cast<unsigned long long>(index), value, body_.left());
        *count = static_cast<std::size_t>(value);
        return {};
    }

    Status skip_property(const PlyElement& element, std::uint64_t index, const PlyProperty& property) {
        std::size_t count = 1;
        if (property.is_list) BURIN_TRY(list_count(element, index, property, &count));
        double ignored = 0;
        for (std::size_t k = 0; k < count; ++k)
            if (!body_.next(property.type, &ignored)) return bad_value(element, index, property);
        return {};
    }

    Status skip(const PlyElement& element) {
        if (element.properties.empty()) return {};
        for (std::uint64_t i = 0; i < element.count; ++i)
            for (const PlyProperty& property : element.properties)
                BURIN_TRY(skip_property(element, i, property));
        return {};
    }

    Status read_vertices(const PlyElement& element) {
        std::vector<int> slots;
        unsigned found = 0;
        PlyType colour_type = PlyType::u8;
        for (const PlyProperty& property : element.properties) {
            const int slot = property.is_list ? -1 : slot_of(property.name);
            slots.push_back(slot);
            if (slot >= 0) found |= 1u << slot;
            if (slot >= 6) colour_type = property.type;
        }
        if ((found & 7) != 7) return Status::error(Code::format, "%s: vertices have no x, y and z", name_);
        const bool normals = (found >> 3 & 7) == 7, colours = (found >> 6 & 7) == 7;
        mesh_.positions.reserve(element.count);
        if (normals) mesh_.normals.reserve(element.count);
        if (colours) mesh_.colours.reserve(element.count);
        for (std::uint64_t i = 0; i < element.count; ++i) {
            double v[9] = {};
            for (std::size_t k = 0; k < slots.size(); ++k) {
                const PlyProperty& property = element.properties[k];
                if (slots[k] < 0) {
                    BURIN_TRY(skip_property(element, i, property));
                } else if (!body_.next(property.type, &v[slots[k]])) {
                    return bad_value(element, i, property);
                }
            }
            const Vec3f p = to_float({v[0], v[1], v[2]});
            if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
                return Status::error(Code::format,
                                     "%s: vertex %llu is at (%g, %g, %g), expected finite numbers", name_,
                                     static_cast<unsigned long long>(i), v[0], v[1], v[2]);
            mesh_.positions.push_back(p);
            if (normals) mesh_.normals.push_back(unit({v[3], v[4], v[5]}));
            if (colours) {
                std::array<std::uint8_t, 3> c{};
                for (std::size_t k = 0; k < 3; ++k)
                    if (!colour_from(colour_type, v[6 + k], &c[k]))
                        return Status::error(Code::format,
                                             "%s: vertex %llu has a colour value %g, expected 0..255", name_,
                                             static_cast<unsigned long long>(i), v[6 + k]);
                mesh_.colours.push_back(c);
            }
        }
        return {};
    }

    // Normals off unit length by rounding only stay as they are, so that our own files come back bit by bit.
    static Vec3f unit(Vec3d n) {
        const double n2 = dot(n, n);
        if (!std::isfinite(n2)) return {};
        constexpr double kRounding =
            1e-3;  // of the squared length; a text file with four digits stays inside
        return to_float(std::fabs(n2 - 1) <= kRounding ? n : normalised(n));
    }

    Status read_faces(const PlyElement& element) {
        const std::size_t none = element.properties.size();
        std::size_t corners = none;
        // What one byte a face carries, and where it goes.
        struct Mark {
            const char* name;
            std::vector<std::uint8_t>* into;
            std::size_t property;
        };
        Mark marks[2] = {{"label", &mesh_.labels, none}, {"filled", &mesh_.filled, none}};
        for (std::size_t k = 0; k < none; ++k) {
            const PlyProperty& p = element.properties[k];
            if (p.is_list && (p.name == "vertex_indices" || p.name == "vertex_index")) corners = k;
            for (Mark& mark : marks)
                if (!p.is_list && p.name == mark.name) mark.property = k;
        }
        if (corners == none)
            return Status::error(Code::format, "%s: faces have no list 'vertex_indices' or 'vertex_index'",
                                 name_);
        if (ply_is_float(element.properties[corners].type))
            return Status::error(
                Code::format, "%s: vertex indices are of a floating type, expected an integer type", name_);
        mesh_.triangles.reserve(element.count);
        for (const Mark& mark : marks)
            if (mark.property != none) mark.into->reserve(element.count);
        for (std::uint64_t i = 0; i < element.count; ++i) {
            const std::size_t first = mesh_.triangles.size();
            double value[2] = {};
            for (std::size_t k = 0; k < none; ++k) {
                const PlyProperty& property = element.properties[k];
                const int mark = k == marks[0].property ? 0 : k == marks[1].property ? 1 : -1;
                if (k == corners) {
                    BURIN_TRY(read_polygon(element, i, property));
                } else if (mark >= 0) {
                    double& v = value[mark];
                    if (!body_.next(property.type, &v)) return bad_value(element, i, property);
                    if (!(v >= 0 && v <= 255 && std::nearbyint(v) == v))
                        return Status::error(Code::format, "%s: face %llu has %s %g, expected 0..255", name_,
                                             static_cast<unsigned long long>(i), marks[mark].name, v);
                } else {
                    BURIN_TRY(skip_property(element, i, property));
                }
            }
            for (int m = 0; m < 2; ++m)
                if (marks[m].property != none)
                    marks[m].into->insert(marks[m].into->end(), mesh_.triangles.size() - first,
                                          static_cast<std::uint8_t>(value[m]));
        }
        return {};
    }

    Status read_polygon(const PlyElement& element, std::uint64_t face, const PlyProperty& property) {
        std::size_t count = 0;
        BURIN_TRY(list_count(element, face, property, &count));
        if (count < 3)
            return Status::error(Code::format, "%s: face %llu has %zu corners, expected at least 3", name_,
                                 static_cast<unsigned long long>(face), count);
        std::uint32_t first = 0, last = 0;
        for (std::size_t k = 0; k < count; ++k) {
            double value = 0;
            if (!body_.next(property.type, &value)) return bad_value(element, face, property);
            if (!(value >= 0 && value < static_cast<double>(vertices_)))
                return Status::error(Code::format, "%s: face %llu uses vertex %g, expected 0..%llu", name_,
                                     static_cast<unsigned long long>(face), value,
                                     static_cast<unsigned long long>(vertices_) - 1);
            const auto index = static_cast<std::uint32_t>(value);
            if (k == 0)
                first = index;
            else if (k >= 2)
                mesh_.triangles.push_back({first, last, index});
            last = index;
        }
        return {};
    }

    const PlyHeader& header_;
    Body body_;
    const char* name_;
    std::uint64_t vertices_ = 0;
    TriangleMesh mesh_;
};

Status read_whole_file(const char* path, std::vector<std::uint8_t>* bytes) {
    std::FILE* file = std::fopen(path, "rb");
    if (!file) return Status::error(Code::io, "cannot open '%s': %s", path, std::strerror(errno));
    Status status;
    constexpr std::size_t kFirst = 1 << 20, kLargest = 64 << 20;  // grow by doubling, then evenly
    try {
        for (std::size_t used = 0;;) {
            bytes->resize(used + std::clamp(used, kFirst, kLargest));
            const std::size_t got = std::fread(bytes->data() + used, 1, bytes->size() - used, file);
            used += got;
            if (used < bytes->size()) {
                if (std::ferror(file))
                    status = Status::error(Code::io, "cannot read '%s': %s", path, std::strerror(errno));
                bytes->resize(used);
                break;
            }
        }
    } catch (const std::exception&) {
        status = Status::error(Code::insufficient_memory, "cannot read '%s': too large for the memory", path);
    }
    std::fclose(file);
    return status;
}

}  // namespace

Result<TriangleMesh> parse_ply(std::span<const std::uint8_t> bytes, const char* name) try {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    Result<PlyHeader> header = parse_ply_header(text, name);
    if (!header) return header.status();
    return Reader(*header, text, name).read();
} catch (const std::exception&) {
    return Status::error(Code::insufficient_memory, "%s: the mesh does not fit into memory", name);
}

Result<TriangleMesh> read_ply(const std::string& path) {
    std::vector<std::uint8_t> bytes;
    BURIN_TRY(read_whole_file(path.c_str(), &bytes));
    return parse_ply(bytes, path.c_str());
}

}  // namespace burin
