// SPDX-License-Identifier: MIT
#include "platform/v4l2/raw_layout.h"

#include <cmath>
#include <cstdlib>
#include <cstring>

namespace burin {
namespace {

struct Field {
    const char* name;
    double least, most;
    bool whole;
};
constexpr Field kFields[] = {
    {"images", 1, 8, true},          {"take", 0, 7, true},
    {"brightness", 0, 7, true},      {"mask", 1, 65535, true},
    {"scale", -65536, 65536, false}, {"offset", -16777216, 16777216, false},
    {"none", 0, 65536, true},        {"unit", 1e-6, 1, false},
    {"confidence", 0, 7, true},      {"certain", 1, 65535, true},
};

void store(const Field& field, double value, RawLayout* l) {
    const int whole = static_cast<int>(value);
    if (!std::strcmp(field.name, "images")) l->images = whole;
    if (!std::strcmp(field.name, "take")) l->take = whole;
    if (!std::strcmp(field.name, "brightness")) l->brightness = whole;
    if (!std::strcmp(field.name, "mask")) l->affine.mask = static_cast<std::uint16_t>(whole);
    if (!std::strcmp(field.name, "scale")) l->affine.scale = static_cast<float>(value);
    if (!std::strcmp(field.name, "offset")) l->affine.offset = static_cast<float>(value);
    if (!std::strcmp(field.name, "none")) l->affine.none = static_cast<std::uint32_t>(whole);
    if (!std::strcmp(field.name, "confidence")) l->confidence = whole;
    if (!std::strcmp(field.name, "certain")) l->certain = whole;
    if (!std::strcmp(field.name, "unit")) l->unit_m = value;
}

}  // namespace

Status parse_raw_layout(const char* text, RawLayout* layout) {
    *layout = RawLayout();
    layout->affine.none = 0;
    for (const char* p = text; *p;) {
        if (*p == ' ') {
            ++p;
            continue;
        }
        const Field* field = nullptr;
        const std::size_t word = std::strcspn(p, " ");
        for (const Field& f : kFields)
            if (std::strncmp(p, f.name, std::strlen(f.name)) == 0 && p[std::strlen(f.name)] == '=')
                field = &f;
        if (!field)
            return Status::error(Code::invalid_argument,
                                 "layout: '%.*s', expected images= take= brightness= confidence= certain= "
                                 "mask= scale= offset= none= or unit=",
                                 static_cast<int>(word < 60 ? word : 60), p);
        char* end = nullptr;
        const char* number = p + std::strlen(field->name) + 1;
        // Hexadecimal too, for masks.
        const double value = std::strtod(number, &end);
        if (end == number || end != p + word || !(value >= field->least && value <= field->most) ||
            (field->whole && value != std::floor(value)))
            return Status::error(Code::invalid_argument, "layout: '%.*s', expected %s=%g..%g",
                                 static_cast<int>(word < 60 ? word : 60), p, field->name, field->least,
                                 field->most);
        store(*field, value, layout);
        p += word;
    }
    for (const int which : {layout->take, layout->brightness, layout->confidence})
        if (which >= layout->images)
            return Status::error(Code::invalid_argument, "layout: image %d of %d, expected less", which,
                                 layout->images);
    return {};
}

}  // namespace burin
