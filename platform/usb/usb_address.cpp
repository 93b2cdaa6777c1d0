// SPDX-License-Identifier: MIT
#include <cstdio>
#include <cstring>

#include "platform/usb/usb_backend.h"

namespace burin {
namespace {

bool hex_id(const char* text, int* value) {
    int v = 0;
    for (int i = 0; i < 4; ++i) {
        const char c = text[i];
        const int digit = c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
        if (digit < 0) return false;
        v = v * 16 + digit;
    }
    *value = v;
    return true;
}

}  // namespace

Status parse_usb_address(const char* text, UsbAddress* address) {
    *address = UsbAddress();
    const char* at = text;
    const auto bad = [&] {
        return Status::error(
            Code::invalid_argument,
            "usb: '%.100s', expected VENDOR:PRODUCT@PLACE as burin devices lists them, any part of it, "
            "and then ,iso ,registered or ,accelerometer",
            text);
    };
    if (*at && *at != '@' && *at != ',') {
        if (!hex_id(at, &address->vendor) || at[4] != ':' || !hex_id(at + 5, &address->product)) return bad();
        at += 9;
    }
    if (*at == '@') {
        const std::size_t length = std::strcspn(++at, ",");
        if (length == 0 || length >= sizeof address->place || std::strspn(at, "0123456789.-") < length)
            return bad();
        std::memcpy(address->place, at, length);
        address->place[length] = 0;
        at += length;
    }
    while (*at == ',') {
        const std::size_t length = std::strcspn(++at, ",");
        const auto is = [&](const char* word) {
            return std::strlen(word) == length && std::memcmp(at, word, length) == 0;
        };
        if (is("iso"))
            address->wishes.isochronous = true;
        else if (is("registered"))
            address->wishes.registered = true;
        else if (is("accelerometer"))
            address->wishes.accelerometer = true;
        else
            return bad();
        at += length;
    }
    return *at ? bad() : Status();
}

}  // namespace burin
