// SPDX-License-Identifier: MIT
// LZFSE, Apple's compression of Record3D's depth. Debian has no library for it, so this is a decoder of our
// own.
//
// Facts of the format, from the declarations and comments of github.com/lzfse/lzfse (src/lzfse_internal.h,
// lzfse_fse.h, lzvn_decode_base.c; Apple 2016): a stream is a row of blocks, each begun by four letters:
//   bvx-  raw: u32 bytes, then those bytes
//   bvxn  LZVN: u32 raw bytes, u32 payload bytes, byte-wise LZ77 opcodes
//   bvx1  LZFSE: literals and (literal length L, match length M, distance D) triplets, each coded by tabled
//         asymmetric numeral systems (Duda, arXiv:1311.2540; "finite state entropy"), tables plain
//   bvx2  the same, with the header's fields and tables packed
//   bvx$  the end
// Little-endian throughout.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "core/status.h"

namespace burin {

// Expands a whole stream. Pure; `name` stands for the file in messages. Error (format): cut, damaged, no
// stream at all, bytes after the end, or more than max_bytes come out; *out is then empty.
Status decode_lzfse(std::string_view bytes, const std::string& name, std::size_t max_bytes, std::string* out);

// Inside: one LZVN payload, appended to *out, which may grow to `limit` bytes. Matches may reach back to the
// beginning of *out. False when the payload is damaged, does not end with its end mark, or wants to grow
// further.
bool decode_lzvn(std::string_view payload, std::size_t limit, std::string* out);
// Inside: `length` bytes from `distance` back, repeating themselves when they overlap.
bool copy_back(std::size_t distance, std::size_t length, std::size_t limit, std::string* out);

}  // namespace burin
