// SPDX-License-Identifier: MIT
#include "datasets/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <new>
#include <system_error>

namespace burin {
namespace fs = std::filesystem;

namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr std::string_view kBlanks = " \t\r\v\f";

// Closes the descriptor whatever happens.
struct Descriptor {
    int fd;
    ~Descriptor() {
        if (fd >= 0) ::close(fd);
    }
};

}  // namespace

Status read_file(const std::string& path, std::size_t max_bytes, std::string* out) {
    out->clear();
    // O_NONBLOCK: opening a pipe by mistake must not wait for a writer.
    const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
    if (file.fd < 0)
        return Status::error(Code::io, "%s: cannot be opened (%s), expected a readable file", path.c_str(),
                             std::strerror(errno));
    struct stat info;
    if (::fstat(file.fd, &info) != 0 || !S_ISREG(info.st_mode))
        return Status::error(Code::io, "%s: is a folder or a device, expected a file", path.c_str());
    if (info.st_size < 0 || static_cast<std::uint64_t>(info.st_size) > max_bytes)
        return Status::error(Code::io, "%s: has %lld bytes, expected at most %zu", path.c_str(),
                             static_cast<long long>(info.st_size), max_bytes);
    try {
        out->resize(static_cast<std::size_t>(info.st_size));
    } catch (const std::bad_alloc&) {
        return Status::error(Code::insufficient_memory, "%s: no memory for its %lld bytes", path.c_str(),
                             static_cast<long long>(info.st_size));
    }
    std::size_t have = 0;
    while (have < out->size()) {
        const ssize_t n = ::read(file.fd, out->data() + have, out->size() - have);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) {
            const char* why = n < 0 ? std::strerror(errno) : "it became shorter while being read";
            const Status status = Status::error(Code::io, "%s: reading stopped at byte %zu of %zu (%s)",
                                                path.c_str(), have, out->size(), why);
            out->clear();
            return status;
        }
        have += static_cast<std::size_t>(n);
    }
    return {};
}

bool is_file(const std::string& path) {
    std::error_code ignored;
    return fs::is_regular_file(path, ignored);
}

bool has_ending(std::string_view path, std::string_view ending) {
    return path.size() >= ending.size() &&
           std::equal(ending.begin(), ending.end(), path.end() - static_cast<std::ptrdiff_t>(ending.size()),
                      [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); });
}

bool is_folder(const std::string& path) {
    std::error_code ignored;
    return fs::is_directory(path, ignored);
}

std::int64_t first_number(std::string_view name) {
    const std::size_t begin = name.find_first_of("0123456789");
    if (begin == std::string_view::npos) return -1;
    std::int64_t value = -1;
    const auto [end, error] = std::from_chars(name.data() + begin, name.data() + name.size(), value);
    return error == std::errc() && end - (name.data() + begin) <= 9 ? value : -1;
}

std::vector<std::string> list_folder(const std::string& path) {
    std::vector<std::string> names;
    std::error_code error;
    for (fs::directory_iterator it(path, error), end; !error && it != end; it.increment(error))
        names.push_back(it->path().filename().string());
    std::sort(names.begin(), names.end(), [](const std::string& a, const std::string& b) {
        const std::int64_t na = first_number(a), nb = first_number(b);
        return na != nb ? na < nb : a < b;
    });
    return names;
}

std::string folder_name(const std::string& path) {
    std::error_code error;
    fs::path whole = fs::weakly_canonical(path, error);
    if (error) whole = path;
    if (!whole.has_filename()) whole = whole.parent_path();
    return whole.filename().string();
}

bool LineReader::next(std::string_view* line) {
    if (rest_.empty()) return false;
    const std::size_t end = rest_.find('\n');
    std::string_view all = rest_.substr(0, end);
    rest_ = end == std::string_view::npos ? std::string_view{} : rest_.substr(end + 1);
    ++number_;
    const std::size_t first = all.find_first_not_of(kBlanks);
    *line = first == std::string_view::npos ? std::string_view{}
                                            : all.substr(first, all.find_last_not_of(kBlanks) - first + 1);
    return true;
}

bool LineReader::next_content(std::string_view* line) {
    while (next(line))
        if (!line->empty() && line->front() != '#') return true;
    return false;
}

int split_words(std::string_view line, std::string_view* words, int capacity) {
    int count = 0;
    for (std::size_t at = line.find_first_not_of(kBlanks); at != std::string_view::npos;
         at = line.find_first_not_of(kBlanks, at)) {
        std::size_t end = line.find_first_of(kBlanks, at);
        if (end == std::string_view::npos) end = line.size();
        if (count < capacity) words[count] = line.substr(at, end - at);
        ++count;
        at = end;
    }
    return count;
}

bool parse_number(std::string_view word, double* value) {
    if (word.size() > 1 && word[0] == '+' && word[1] != '-')
        word.remove_prefix(1);  // from_chars takes no plus
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), *value);
    return error == std::errc() && end == word.data() + word.size();
}

bool parse_seconds(std::string_view word, std::int64_t* t_ns) {
    std::string_view digits = word;
    const bool negative = !digits.empty() && digits.front() == '-';
    if (negative) digits.remove_prefix(1);
    if (digits.find_first_not_of("0123456789.") == std::string_view::npos) {
        std::int64_t whole = 0, fraction = 0;
        const std::size_t point = std::min(digits.find('.'), digits.size());
        if (point == 0 || point > 10) return false;
        for (char c : digits.substr(0, point)) whole = 10 * whole + (c - '0');
        std::int64_t place = kNsPerSecond;
        for (char c : digits.substr(std::min(point + 1, digits.size()))) {
            if (c == '.') return false;
            place /= 10;
            fraction += place * (c - '0');
        }
        if (whole > 9'200'000'000) return false;  // the int64 range ends at 9.22e9 s
        *t_ns = whole * kNsPerSecond + fraction;
        if (negative) *t_ns = -*t_ns;
        return true;
    }
    double seconds = 0;  // an exponent, as numpy.savetxt writes by default
    if (!parse_number(word, &seconds) || !(std::fabs(seconds) <= 9.2e9)) return false;
    const double whole = static_cast<double>(static_cast<std::int64_t>(seconds));
    *t_ns =
        static_cast<std::int64_t>(whole) * kNsPerSecond + static_cast<std::int64_t>((seconds - whole) * 1e9);
    return true;
}

std::string format_seconds(std::int64_t t_ns) {
    const bool negative = t_ns < 0;
    const std::uint64_t n =
        negative ? 0 - static_cast<std::uint64_t>(t_ns) : static_cast<std::uint64_t>(t_ns);
    char text[32];
    std::snprintf(text, sizeof text, "%s%llu.%09llu", negative ? "-" : "",
                  static_cast<unsigned long long>(n / kNsPerSecond),
                  static_cast<unsigned long long>(n % kNsPerSecond));
    return text;
}

std::string printable(std::string_view word) {
    constexpr std::size_t kShown = 40;  // three of them and two paths still fit a Status
    std::string text(word.substr(0, kShown));
    for (char& c : text)
        if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7f) c = '?';
    if (word.size() > kShown) text += "...";
    return text;
}

}  // namespace burin
