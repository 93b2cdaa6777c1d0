// SPDX-License-Identifier: MIT
// LZVN, what LZFSE uses for short inputs. An opcode is 1 to 3 bytes: L literal bytes that follow it, then a
// match of M bytes from D back. Bits of the first byte, high to low:
//   LLMMMDDD DDDDDDDD           D < 1536: the low three bits 110 and 111 are taken by the two next
//   LLMMM110                    D as before
//   LLMMM111 DDDDDDDD DDDDDDDD  D little-endian
//   101LLMMM DDDDDDMM DDDDDDDD  M has five bits, the lower two in the second byte
//   1110LLLL, 11100000 LLLLLLLL literals alone, the longer form from 16 on
//   1111MMMM, 11110000 MMMMMMMM a match alone, D as before, the longer form from 16 on
//   00000110 and seven bytes    the end;  00001110 and 00010110: nothing
// M of the first four counts from 3.
#include "datasets/lzfse.h"

namespace burin {
namespace {

constexpr std::size_t kEndBytes = 8;

struct Opcode {
    std::size_t bytes = 1, literals = 0, match = 0, distance = 0;  // distance 0: as before
};

std::size_t byte_at(std::string_view s, std::size_t i) { return static_cast<unsigned char>(s[i]); }

bool undefined(std::size_t op) {
    return (op >= 0x70 && op < 0x80) || (op >= 0xD0 && op < 0xE0) || (op < 0x40 && op % 8 == 6);
}

std::size_t length_of(std::size_t op) {
    if (op >= 0xE0) return op % 16 == 0 ? 2 : 1;
    if (op >= 0xA0 && op < 0xC0) return 3;
    return op % 8 == 7 ? 3 : op % 8 == 6 ? 1 : 2;
}

// s has length_of bytes.
Opcode opcode_at(std::string_view s) {
    const std::size_t op = byte_at(s, 0);
    Opcode o;
    o.bytes = length_of(op);
    if (op >= 0xE0) {
        const std::size_t count = o.bytes == 2 ? byte_at(s, 1) + 16 : op % 16;
        (op >= 0xF0 ? o.match : o.literals) = count;
        return o;
    }
    if (op >= 0xA0 && op < 0xC0) {
        o.literals = op >> 3 & 3;
        o.match = ((op & 7) << 2 | (byte_at(s, 1) & 3)) + 3;
        o.distance = byte_at(s, 1) >> 2 | byte_at(s, 2) << 6;
        return o;
    }
    o.literals = op >> 6;
    o.match = (op >> 3 & 7) + 3;
    if (o.bytes == 2) o.distance = (op & 7) << 8 | byte_at(s, 1);
    if (o.bytes == 3) o.distance = byte_at(s, 1) | byte_at(s, 2) << 8;
    return o;
}

}  // namespace

bool copy_back(std::size_t distance, std::size_t length, std::size_t limit, std::string* out) {
    if (distance == 0 || distance > out->size() || length > limit - out->size()) return false;
    const std::size_t from = out->size() - distance;
    out->resize(out->size() + length);
    char* to = out->data() + from + distance;
    for (std::size_t i = 0; i < length; ++i)
        to[i] = to[static_cast<std::ptrdiff_t>(i) - static_cast<std::ptrdiff_t>(distance)];
    return true;
}

bool decode_lzvn(std::string_view s, std::size_t limit, std::string* out) {
    std::size_t distance = 0;
    while (!s.empty()) {
        const std::size_t op = byte_at(s, 0);
        if (op == 0x06) return s.size() == kEndBytes;
        if (op == 0x0E || op == 0x16) {
            s.remove_prefix(1);
            continue;
        }
        if (undefined(op) || s.size() < length_of(op)) return false;
        const Opcode o = opcode_at(s);
        s.remove_prefix(o.bytes);
        if (o.literals > s.size() || o.literals > limit - out->size()) return false;
        out->append(s.substr(0, o.literals));
        s.remove_prefix(o.literals);
        // A written distance of 0 is damage.
        if (op < 0xE0 && o.bytes > 1 && o.distance == 0) return false;
        if (o.distance != 0) distance = o.distance;
        if (o.match > 0 && !copy_back(distance, o.match, limit, out)) return false;
    }
    return false;  // no end mark
}

}  // namespace burin
