// SPDX-License-Identifier: MIT
#include "export/ply_header.h"

#include <algorithm>
#include <charconv>
#include <optional>

namespace burin {
namespace {

// Far above what any exporter writes; they bound the work a hostile header can cause.
constexpr std::size_t kMaxLine = 4096;
constexpr std::size_t kMaxElements = 32;
constexpr std::size_t kMaxProperties = 256;
constexpr std::string_view kNameCharacters =
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.:+*/()[]<>#@!?&%$=~^|;,'{}";

std::string_view next_word(std::string_view& line) {
    const std::size_t begin = line.find_first_not_of(" \t");
    if (begin == std::string_view::npos) {
        line = {};
        return {};
    }
    const std::size_t end = std::min(line.find_first_of(" \t", begin), line.size());
    const std::string_view word = line.substr(begin, end - begin);
    line.remove_prefix(end);
    return word;
}

std::optional<PlyType> type_of(std::string_view word) {
    struct Name {
        const char* old_name;
        const char* sized_name;
        PlyType type;
    };
    constexpr Name kNames[] = {{"char", "int8", PlyType::i8},      {"uchar", "uint8", PlyType::u8},
                               {"short", "int16", PlyType::i16},   {"ushort", "uint16", PlyType::u16},
                               {"int", "int32", PlyType::i32},     {"uint", "uint32", PlyType::u32},
                               {"float", "float32", PlyType::f32}, {"double", "float64", PlyType::f64}};
    for (const Name& n : kNames)
        if (word == n.old_name || word == n.sized_name) return n.type;
    return std::nullopt;
}

// For messages: the start of a word or line that may hold anything.
std::string printable(std::string_view text) {
    std::string out(text.substr(0, 40));
    for (char& c : out)
        if (c < ' ' || c > '~') c = '?';
    return out;
}

// Names appear in messages, which are one line of plain text.
bool is_name(std::string_view word) {
    return !word.empty() && word.find_first_not_of(kNameCharacters) == word.npos;
}

Status parse_property(std::string_view line, PlyElement* element, const char* name) {
    if (element->properties.size() == kMaxProperties)
        return Status::error(Code::format, "%s: element '%s' has over %zu properties", name,
                             printable(element->name).c_str(), kMaxProperties);
    PlyProperty property;
    std::string_view word = next_word(line);
    if (word == "list") {
        property.is_list = true;
        const std::string_view count_word = next_word(line);
        const auto count_type = type_of(count_word);
        if (!count_type || ply_is_float(*count_type))
            return Status::error(Code::format,
                                 "%s: list count type '%s', expected an integer type such as uchar", name,
                                 printable(count_word).c_str());
        property.count_type = *count_type;
        word = next_word(line);
    }
    const auto type = type_of(word);
    if (!type)
        return Status::error(Code::format, "%s: property type '%s', expected char, uchar ... float, double",
                             name, printable(word).c_str());
    property.type = *type;
    property.name = next_word(line);
    if (!is_name(property.name))
        return Status::error(Code::format,
                             "%s: a property of '%s' is named '%s', expected a word of plain letters", name,
                             element->name.c_str(), printable(property.name).c_str());
    for (const PlyProperty& other : element->properties)
        if (other.name == property.name)
            return Status::error(Code::format, "%s: property '%s' appears twice", name,
                                 printable(property.name).c_str());
    element->properties.push_back(std::move(property));
    return {};
}

Status parse_element(std::string_view line, PlyHeader* header, const char* name) {
    if (header->elements.size() == kMaxElements)
        return Status::error(Code::format, "%s: over %zu elements in the header", name, kMaxElements);
    PlyElement element;
    element.name = next_word(line);
    if (!is_name(element.name) || element.name.size() > 40)
        return Status::error(Code::format,
                             "%s: an element is named '%s', expected a word of up to 40 plain letters", name,
                             printable(element.name).c_str());
    const std::string_view count = next_word(line);
    const auto parsed = std::from_chars(count.data(), count.data() + count.size(), element.count);
    if (count.empty() || parsed.ec != std::errc() || parsed.ptr != count.data() + count.size())
        return Status::error(Code::format, "%s: element '%s' has count '%s', expected a number", name,
                             printable(element.name).c_str(), printable(count).c_str());
    for (const PlyElement& other : header->elements)
        if (other.name == element.name)
            return Status::error(Code::format, "%s: element '%s' appears twice", name,
                                 printable(element.name).c_str());
    header->elements.push_back(std::move(element));
    return {};
}

Status parse_format(std::string_view line, PlyHeader* header, const char* name) {
    const std::string_view encoding = next_word(line), version = next_word(line);
    if (encoding == "ascii")
        header->encoding = PlyEncoding::ascii;
    else if (encoding == "binary_little_endian")
        header->encoding = PlyEncoding::little_endian;
    else if (encoding == "binary_big_endian")
        header->encoding = PlyEncoding::big_endian;
    else
        return Status::error(Code::format,
                             "%s: PLY format '%s', expected ascii, binary_little_endian or binary_big_endian",
                             name, printable(encoding).c_str());
    if (version != "1.0")
        return Status::error(Code::format, "%s: PLY version '%s', expected 1.0", name,
                             printable(version).c_str());
    return {};
}

}  // namespace

Result<PlyHeader> parse_ply_header(std::string_view bytes, const char* name) {
    PlyHeader header;
    bool has_format = false;
    for (std::size_t position = 0, line_number = 1;; ++line_number) {
        const std::size_t end = bytes.substr(position, kMaxLine).find('\n');
        if (line_number == 1) {
            const std::string_view magic = bytes.substr(0, 4);
            if (magic != "ply\n" && magic != "ply\r")
                return Status::error(Code::format, "%s: begins with '%s', expected a line 'ply'", name,
                                     printable(magic).c_str());
        }
        if (end == std::string_view::npos)
            return Status::error(Code::format,
                                 "%s: header line %zu does not end within %zu bytes, expected 'end_header'",
                                 name, line_number, kMaxLine);
        std::string_view line = bytes.substr(position, end);
        position += end + 1;
        if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
        std::string_view rest = line;
        const std::string_view keyword = next_word(rest);
        if (line_number == 1 || keyword.empty() || keyword == "comment" || keyword == "obj_info") continue;
        if (keyword == "end_header") {
            header.body = position;
            break;
        }
        if (keyword == "format") {
            BURIN_TRY(parse_format(rest, &header, name));
            has_format = true;
        } else if (keyword == "element") {
            BURIN_TRY(parse_element(rest, &header, name));
        } else if (keyword == "property") {
            if (header.elements.empty())
                return Status::error(Code::format, "%s: header line %zu is a property before any element",
                                     name, line_number);
            BURIN_TRY(parse_property(rest, &header.elements.back(), name));
        } else {
            return Status::error(
                Code::format,
                "%s: header line %zu is '%s', expected format, comment, element, property or end_header",
                name, line_number, printable(line).c_str());
        }
    }
    if (!has_format) return Status::error(Code::format, "%s: the header has no 'format' line", name);
    return header;
}

}  // namespace burin
