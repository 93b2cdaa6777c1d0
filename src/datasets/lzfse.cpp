// SPDX-License-Identifier: MIT
#include "datasets/lzfse.h"

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace burin {
namespace {

// Symbols and states of the four tables, and the most that one block holds (lzfse_internal.h).
constexpr int kLengthSymbols = 20, kDistanceSymbols = 64, kLiteralSymbols = 256;
constexpr int kLengthStates = 64, kDistanceStates = 256, kLiteralStates = 1024;
constexpr int kFrequencies = 2 * kLengthSymbols + kDistanceSymbols + kLiteralSymbols;
constexpr std::uint32_t kMostMatches = 10000, kMostLiterals = 4 * kMostMatches;
constexpr std::size_t kV1Bytes = 772, kV2FixedBytes = 32;  // 50 + 2 * 360 rounded up to 4; 8 + 3 * 8

std::uint64_t little(std::string_view s, std::size_t at, int bytes) {
    std::uint64_t value = 0;
    for (int i = 0; i < bytes; ++i)
        value |= std::uint64_t{static_cast<unsigned char>(s[at + static_cast<std::size_t>(i)])} << (8 * i);
    return value;
}

std::uint32_t field(std::uint64_t packed, int from, int bits) {
    return static_cast<std::uint32_t>(packed >> from & ((std::uint64_t{1} << bits) - 1));
}

// What both headers say.
struct Header {
    std::size_t bytes = 0, raw_bytes = 0;
    std::uint32_t literals = 0, matches = 0, literal_bytes = 0, triplet_bytes = 0;
    int literal_bits = 0, triplet_bits = 0;  // -7..0: bits of the last byte that are not in use
    std::uint32_t literal_state[4] = {}, state[3] = {};
    std::array<std::uint16_t, kFrequencies> frequency{};  // of L, M, D, literals
};

// A frequency takes 2, 3, 5, 8 or 14 bits: 00 0, 10 1, 001 2, 101 3, vv011 4+v, vvvv0111 8+v,
// v(10)1111 24+v.
struct Coded {
    int bits;
    std::uint32_t value;
};
Coded coded_frequency(std::uint32_t b) {
    if ((b & 1) == 0) return {2, b >> 1 & 1};
    if ((b & 2) == 0) return {3, 2 + (b >> 2 & 1)};
    if ((b & 4) == 0) return {5, 4 + (b >> 3 & 3)};
    if ((b & 8) == 0) return {8, 8 + (b >> 4 & 15)};
    return {14, 24 + (b >> 4 & 1023)};
}

bool read_packed_tables(std::string_view s, Header* h) {
    if (s.empty()) return true;  // left out: nothing is coded by them
    std::uint32_t bits = 0;
    int have = 0;
    std::size_t at = 0;
    for (std::uint16_t& frequency : h->frequency) {
        for (; have <= 24 && at < s.size(); have += 8)
            bits |= std::uint32_t{static_cast<unsigned char>(s[at++])} << have;
        const Coded coded = coded_frequency(bits);
        if (coded.bits > have) return false;
        frequency = static_cast<std::uint16_t>(coded.value);
        bits >>= coded.bits;
        have -= coded.bits;
    }
    return at == s.size() && have < 8;
}

bool read_v2(std::string_view s, Header* h) {
    if (s.size() < kV2FixedBytes) return false;
    h->raw_bytes = little(s, 4, 4);
    const std::uint64_t a = little(s, 8, 8), b = little(s, 16, 8), c = little(s, 24, 8);
    h->literals = field(a, 0, 20);
    h->literal_bytes = field(a, 20, 20);
    h->matches = field(a, 40, 20);
    h->literal_bits = static_cast<int>(field(a, 60, 3)) - 7;
    for (int i = 0; i < 4; ++i) h->literal_state[i] = field(b, 10 * i, 10);
    h->triplet_bytes = field(b, 40, 20);
    h->triplet_bits = static_cast<int>(field(b, 60, 3)) - 7;
    h->bytes = field(c, 0, 32);
    for (int i = 0; i < 3; ++i) h->state[i] = field(c, 32 + 10 * i, 10);
    if (h->bytes < kV2FixedBytes || h->bytes > s.size()) return false;
    return read_packed_tables(s.substr(kV2FixedBytes, h->bytes - kV2FixedBytes), h);
}

bool read_v1(std::string_view s, Header* h) {
    if (s.size() < kV1Bytes) return false;
    h->bytes = kV1Bytes;
    h->raw_bytes = little(s, 4, 4);
    const auto u32 = [&](std::size_t at) { return static_cast<std::uint32_t>(little(s, at, 4)); };
    h->literals = u32(12);
    h->matches = u32(16);
    h->literal_bytes = u32(20);
    h->triplet_bytes = u32(24);
    h->literal_bits = static_cast<std::int32_t>(u32(28));
    for (std::size_t i = 0; i < 4; ++i)
        h->literal_state[i] = static_cast<std::uint32_t>(little(s, 32 + 2 * i, 2));
    h->triplet_bits = static_cast<std::int32_t>(u32(40));
    for (std::size_t i = 0; i < 3; ++i) h->state[i] = static_cast<std::uint32_t>(little(s, 44 + 2 * i, 2));
    for (std::size_t i = 0; i < kFrequencies; ++i)
        h->frequency[i] = static_cast<std::uint16_t>(little(s, 50 + 2 * i, 2));
    return true;
}

// Bits of a payload from its end to its beginning.
class BitsBackwards {
  public:
    // unused: -7..0, see Header.
    BitsBackwards(std::string_view bytes, int unused)
        : bytes_(bytes), left_(8 * static_cast<std::int64_t>(bytes.size()) + unused) {}
    // 0..23 bits. More than there are: 0, and ok() is false from then on.
    std::uint32_t pull(int count) {
        left_ -= count;
        if (left_ < 0) return 0;
        const auto at = static_cast<std::size_t>(left_ / 8);
        const std::size_t here = bytes_.size() - at;
        // 23 bits lie in four bytes at most.
        const std::uint64_t word = little(bytes_, at, here < 4 ? static_cast<int>(here) : 4);
        return field(word, static_cast<int>(left_ % 8), count);
    }
    bool ok() const { return left_ >= 0; }

  private:
    std::string_view bytes_;
    std::int64_t left_;
};

// A table of states. State s of a symbol of frequency f stands for the number x = f + (its place among the f
// states of that symbol); the next state is x with as many bits from the payload behind it as bring it into
// [states, 2 states), less states.
struct State {
    std::uint8_t bits = 0, symbol = 0;
    std::uint16_t base = 0;
};
class Table {
  public:
    bool build(const std::uint16_t* frequency, int symbols, int states) {
        states_.clear();
        for (int symbol = 0; symbol < symbols; ++symbol) {
            const unsigned f = frequency[symbol];
            if (f > static_cast<unsigned>(states) - states_.size()) return false;
            for (unsigned x = f; x < 2 * f; ++x) {
                const int bits = std::bit_width(static_cast<unsigned>(states)) - std::bit_width(x);
                states_.push_back({static_cast<std::uint8_t>(bits), static_cast<std::uint8_t>(symbol),
                                   static_cast<std::uint16_t>((x << bits) - static_cast<unsigned>(states))});
            }
        }
        return true;
    }
    // The symbol of *state and the next state; -1 when no symbol has it.
    int next(std::uint32_t* state, BitsBackwards* bits) const {
        if (*state >= states_.size()) return -1;
        const State& s = states_[*state];
        *state = s.base + bits->pull(s.bits);
        return s.symbol;
    }

  private:
    std::vector<State> states_;
};

// A symbol of lengths and distances stands for a base and that many bits of an offset, which lie below the
// bits of the state: the base of each is where the symbol before it ends.
struct Values {
    std::array<std::uint8_t, 64> bits{};
    std::array<std::uint32_t, 64> base{};
    void set(int symbol, int extra) {
        const auto i = static_cast<std::size_t>(symbol);
        bits[i] = static_cast<std::uint8_t>(extra);
        base[i] = symbol == 0 ? 0 : base[i - 1] + (1u << bits[i - 1]);
    }
};
Values length_values(const int (&last)[4]) {
    Values v;
    for (int i = 0; i < 16; ++i) v.set(i, 0);
    for (int i = 0; i < 4; ++i) v.set(16 + i, last[i]);
    return v;
}
const Values& literal_lengths() {
    static const Values v = length_values({2, 3, 5, 8});
    return v;
}
const Values& match_lengths() {
    static const Values v = length_values({3, 5, 8, 11});
    return v;
}
const Values& distances() {
    static const Values v = [] {
        Values d;
        for (int i = 0; i < kDistanceSymbols; ++i) d.set(i, i / 4);
        return d;
    }();
    return v;
}

bool next_value(const Table& table, const Values& values, std::uint32_t* state, BitsBackwards* bits,
                std::uint32_t* value) {
    const int symbol = table.next(state, bits);
    if (symbol < 0) return false;
    const auto i = static_cast<std::size_t>(symbol);
    *value = values.base[i] + bits->pull(values.bits[i]);
    return bits->ok();
}

bool decode_literals(const Header& h, std::string_view payload, std::string* literals) {
    Table table;
    if (!table.build(h.frequency.data() + 2 * kLengthSymbols + kDistanceSymbols, kLiteralSymbols,
                     kLiteralStates))
        return false;
    BitsBackwards bits(payload, h.literal_bits);
    std::uint32_t state[4] = {h.literal_state[0], h.literal_state[1], h.literal_state[2], h.literal_state[3]};
    literals->resize(h.literals);
    for (std::uint32_t i = 0; i < h.literals; ++i) {
        const int symbol = table.next(&state[i % 4], &bits);
        if (symbol < 0) return false;
        (*literals)[i] = static_cast<char>(symbol);
    }
    return bits.ok();
}

// The block of *h behind its header: literals, then triplets.
bool decode_block(const Header& h, std::string_view payload, std::size_t limit, std::string* out) {
    std::string literals;
    if (!decode_literals(h, payload.substr(0, h.literal_bytes), &literals)) return false;
    Table lengths, matches, far;
    if (!lengths.build(h.frequency.data(), kLengthSymbols, kLengthStates) ||
        !matches.build(h.frequency.data() + kLengthSymbols, kLengthSymbols, kLengthStates) ||
        !far.build(h.frequency.data() + 2 * kLengthSymbols, kDistanceSymbols, kDistanceStates))
        return false;
    BitsBackwards bits(payload.substr(h.literal_bytes, h.triplet_bytes), h.triplet_bits);
    std::uint32_t state[3] = {h.state[0], h.state[1], h.state[2]};
    std::size_t used = 0, distance = 0;
    for (std::uint32_t i = 0; i < h.matches; ++i) {
        std::uint32_t l = 0, m = 0, d = 0;
        if (!next_value(lengths, literal_lengths(), &state[0], &bits, &l) ||
            !next_value(matches, match_lengths(), &state[1], &bits, &m) ||
            !next_value(far, distances(), &state[2], &bits, &d))
            return false;
        if (l > literals.size() - used || l > limit - out->size()) return false;
        out->append(literals, used, l);
        used += l;
        if (d != 0) distance = d;  // 0: as before
        if (m > 0 && !copy_back(distance, m, limit, out)) return false;
    }
    return true;
}

// One block at the beginning of s. *used: its bytes.
bool decode_any(std::string_view s, std::size_t max_bytes, std::string* out, std::size_t* used) {
    const std::size_t before = out->size();
    const char kind = s[3];
    if (kind == '-') {
        if (s.size() < 8) return false;
        const std::size_t bytes = little(s, 4, 4);
        if (bytes > s.size() - 8 || bytes > max_bytes - before) return false;
        out->append(s.substr(8, bytes));
        *used = 8 + bytes;
        return true;
    }
    if (kind == 'n') {
        if (s.size() < 12) return false;
        const std::size_t raw = little(s, 4, 4), bytes = little(s, 8, 4);
        if (bytes > s.size() - 12 || raw > max_bytes - before) return false;
        *used = 12 + bytes;
        return decode_lzvn(s.substr(12, bytes), before + raw, out) && out->size() == before + raw;
    }
    Header h;
    if ((kind != '1' && kind != '2') || !(kind == '1' ? read_v1(s, &h) : read_v2(s, &h))) return false;
    const auto in_byte = [](int unused) { return unused >= -7 && unused <= 0; };
    if (h.literals > kMostLiterals || h.matches > kMostMatches || !in_byte(h.literal_bits) ||
        !in_byte(h.triplet_bits) || h.raw_bytes > max_bytes - before)
        return false;
    const std::uint64_t payload = std::uint64_t{h.literal_bytes} + h.triplet_bytes;
    if (payload > s.size() - h.bytes) return false;
    *used = h.bytes + static_cast<std::size_t>(payload);
    return decode_block(h, s.substr(h.bytes), before + h.raw_bytes, out) &&
           out->size() == before + h.raw_bytes;
}

Status decode_blocks(std::string_view bytes, const std::string& name, std::size_t max_bytes,
                     std::string* out) {
    std::size_t at = 0;
    while (true) {
        const std::string_view rest = bytes.substr(at);
        if (rest.substr(0, 3) != "bvx" || rest.size() < 4)
            return Status::error(Code::format,
                                 "%s: no LZFSE block at byte %zu of %zu, expected one or the end mark",
                                 name.c_str(), at, bytes.size());
        if (rest[3] == '$') {
            if (rest.size() == 4) return {};
            return Status::error(Code::format, "%s: %zu bytes after LZFSE's end mark, expected none",
                                 name.c_str(), rest.size() - 4);
        }
        std::size_t used = 0;
        if (!decode_any(rest, max_bytes, out, &used))
            return Status::error(
                Code::format,
                "%s: LZFSE block at byte %zu of %zu is cut or damaged, expected a whole one of at "
                "most %zu bytes in all",
                name.c_str(), at, bytes.size(), max_bytes);
        at += used;
    }
}

}  // namespace

Status decode_lzfse(std::string_view bytes, const std::string& name, std::size_t max_bytes,
                    std::string* out) {
    out->clear();
    Status status;
    try {
        status = decode_blocks(bytes, name, max_bytes, out);
    } catch (...) {
        status = Status::error(Code::insufficient_memory, "%s: no memory to expand it", name.c_str());
    }
    if (!status) out->clear();
    return status;
}

}  // namespace burin
