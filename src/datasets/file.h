// SPDX-License-Identifier: MIT
// Whole files in, and the few text helpers every reader of this room shares.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/status.h"

namespace burin {

// No text a data set brings is larger: an hour of 1 kHz poses at 90 bytes a line is 324 MB.
inline constexpr std::size_t kMaxTextBytes = std::size_t(512) << 20;
// 16384 x 16384 x 3 x 16 bit is 1.6 GB uncompressed; no camera delivers a file above this.
inline constexpr std::size_t kMaxImageBytes = std::size_t(1) << 30;

// Reads a regular file. Error (io): missing, a folder, not readable, larger than max_bytes; *out is then
// empty.
Status read_file(const std::string& path, std::size_t max_bytes, std::string* out);

bool is_file(const std::string& path);
bool is_folder(const std::string& path);
// Capital letters count as small ones.
bool has_ending(std::string_view path, std::string_view small_ending);
// Names (not paths) in a folder, sorted by their first number, then by name: 2.png before 10.png. Empty when
// the folder cannot be read.
std::vector<std::string> list_folder(const std::string& path);
// The first run of digits in a name: a frame number. -1 when there is none or it has more than 9 digits, as
// stamps have.
std::int64_t first_number(std::string_view name);
// Last component of a path, also for "." and for a trailing slash.
std::string folder_name(const std::string& path);

// Steps through the lines of a text. Blanks at both ends and a carriage return are cut off.
class LineReader {
  public:
    explicit LineReader(std::string_view text) : rest_(text) {}
    bool next(std::string_view* line);  // false at the end
    // As next, but passes over empty lines and lines that begin with '#'.
    bool next_content(std::string_view* line);
    int number() const { return number_; }  // of the line last given, from 1

  private:
    std::string_view rest_;
    int number_ = 0;
};

// Splits at blanks and tabs. Fills at most `capacity` words and returns how many there are in all.
int split_words(std::string_view line, std::string_view* words, int capacity);

// The whole word must be a number. Accepts nan and inf: callers say what they think of them.
bool parse_number(std::string_view word, double* value);
// Decimal seconds to nanoseconds, exactly (a double holds today's Unix time to 0.2 microseconds only). Digits
// beyond the ninth are dropped. False when it is no number or outside +-9.2e9 s.
bool parse_seconds(std::string_view word, std::int64_t* t_ns);
std::string format_seconds(std::int64_t t_ns);  // nine decimals

// A word from a file made fit for a one-line message: cut to 40 characters, unprintable ones replaced.
std::string printable(std::string_view word);

}  // namespace burin
