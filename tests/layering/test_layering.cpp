// SPDX-License-Identifier: MIT
// The floors of the design, enforced: a file includes only from its own room and from floors below, and rooms
// on one floor do not know each other. Also the length of files. Both read the sources as text.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

// Floor of each room, counted from the ground (design, "The way of a frame"). platform/ holds one room per
// back end.
// clang-format off
const std::map<std::string, int> kFloors = {
    {"core", 0},
    {"simd", 1},
    {"capture", 2},
    {"datasets", 3}, {"platform", 3},  // both implement capture
    {"depth", 4},
    {"map", 5},
    {"track", 6}, {"planes", 6}, {"mesh", 6}, {"refine", 6}, {"neural", 6}, {"export", 6}, {"eval", 6},
    {"session", 7},
    {"api", 8},
    {"cli", 9},
};
// clang-format on

// The public headers know nothing of the rooms; only what stands on top of the stages may know them.
constexpr int kFirstFloorWithPublicHeaders = 7;

// Libraries whose headers are written with quotes by their own documentation.
const std::set<std::string> kQuotedLibraries = {"hwy"};

// The runtime is what gets embedded: it depends on the C++ library, threads, Highway and Eigen. These belong
// to tools.
const std::set<std::string> kRuntimeRooms = {"core",  "simd",   "depth",   "map", "mesh",
                                             "track", "planes", "session", "api"};
const char* const kToolLibraries[] = {"CLI/",      "nlohmann/",   "tiny_gltf", "png.h",  "libpng",
                                      "jpeglib.h", "turbojpeg.h", "gtest/",    "open3d/"};

bool is_tool_library(const std::string& path) {
    return std::any_of(std::begin(kToolLibraries), std::end(kToolLibraries),
                       [&](const char* start) { return path.rfind(start, 0) == 0; });
}

struct Include {
    int line;
    bool quoted;
    std::string path;
};

// Reads `# include "path"` or `<path>`, with blanks wherever the language allows them.
std::vector<Include> includes_of(const std::string& text) {
    std::vector<Include> found;
    std::istringstream lines(text);
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
        const auto skip_blanks = [&](std::size_t at) { return line.find_first_not_of(" \t", at); };
        const std::size_t hash = skip_blanks(0);
        if (hash == std::string::npos || line[hash] != '#') continue;
        const std::size_t word = skip_blanks(hash + 1);
        if (word == std::string::npos || line.compare(word, 7, "include") != 0) continue;
        const std::size_t open = skip_blanks(word + 7);
        if (open == std::string::npos || (line[open] != '"' && line[open] != '<')) continue;
        const std::size_t close = line.find(line[open] == '"' ? '"' : '>', open + 1);
        if (close != std::string::npos)
            found.push_back({number, line[open] == '"', line.substr(open + 1, close - open - 1)});
    }
    return found;
}

// "src/map/x.h" -> "map", "platform/v4l2/y.cpp" -> "platform/v4l2", "include/burin/burin.h" -> "burin".
std::string room_of_file(const std::string& path) {
    std::vector<std::string> parts;
    for (const auto& part : fs::path(path)) parts.push_back(part.string());
    if (parts.size() < 3) return {};
    return parts[0] == "platform" ? "platform/" + parts[1] : parts[1];
}

std::string room_of_include(const std::string& path) {
    const auto slash = path.find('/');
    if (slash == std::string::npos) return {};
    if (path.compare(0, slash, "platform") != 0) return path.substr(0, slash);
    return path.substr(0, path.find('/', slash + 1));
}

int floor_of(const std::string& room) {
    const auto found = kFloors.find(room.substr(0, room.find('/')));
    return found == kFloors.end() ? -1 : found->second;
}

// What is wrong with the includes of one file, one line each.
std::vector<std::string> violations(const std::string& file, const std::string& text) {
    std::vector<std::string> found;
    const std::string room = room_of_file(file);
    const bool is_public = room == "burin";
    const int floor = floor_of(room);
    if (floor < 0 && !is_public) return {file + ": room '" + room + "' has no floor in tests/layering"};
    for (const Include& include : includes_of(text)) {
        const auto complain = [&](const std::string& why) {
            found.push_back(file + ":" + std::to_string(include.line) + ": \"" + include.path + "\" " + why);
        };
        if (!include.quoted) {
            if (kRuntimeRooms.count(room) && is_tool_library(include.path))
                complain("is a library of the tools; the runtime depends on none");
            continue;
        }
        const std::string other = room_of_include(include.path);
        if (kQuotedLibraries.count(other) || other == room) continue;
        if (other.empty() || include.path.find("..") != std::string::npos)
            complain("has no room; write it from the root, as in \"core/status.h\"");
        else if (is_public)
            complain("is no public header; those under include/ know only each other");
        else if (other == "burin") {
            if (floor < kFirstFloorWithPublicHeaders)
                complain("is the public interface, which lies above '" + room + "'");
        } else if (floor_of(other) < 0)
            complain("is in no known room");
        else if (floor_of(other) > floor)
            complain("lies on a floor above '" + room + "'");
        else if (floor_of(other) == floor)
            complain("lies beside '" + room + "'; rooms on one floor do not know each other");
    }
    return found;
}

std::string read(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

// Every source file under the three trees, as paths from the root, sorted.
std::vector<std::string> sources() {
    const fs::path root = BURIN_SOURCE_DIR;
    const std::set<std::string> extensions = {".h", ".hpp", ".c", ".cpp"};
    std::vector<std::string> files;
    for (const char* tree : {"src", "platform", "include"}) {
        if (!fs::exists(root / tree)) continue;
        for (const auto& entry : fs::recursive_directory_iterator(root / tree))
            if (entry.is_regular_file() && extensions.count(entry.path().extension().string()))
                files.push_back(fs::relative(entry.path(), root).generic_string());
    }
    std::sort(files.begin(), files.end());
    return files;
}

std::string joined(const std::vector<std::string>& lines) {
    std::string text;
    for (const auto& line : lines) text += line + "\n";
    return text;
}

TEST(Layering, EveryIncludePointsDown) {
    const auto files = sources();
    ASSERT_GE(files.size(), 10u) << "the sources were not found under " << BURIN_SOURCE_DIR;
    for (const auto& file : files) {
        const auto found = violations(file, read(fs::path(BURIN_SOURCE_DIR) / file));
        EXPECT_TRUE(found.empty()) << joined(found);
    }
}

TEST(Layering, FindsWhatItIsThereToFind) {
    const auto count = [](const char* file, const char* text) { return violations(file, text).size(); };
    EXPECT_EQ(count("src/map/a.h", "#include \"core/status.h\"\n#include \"map/b.h\"\n#include <vector>\n"),
              0u);
    EXPECT_EQ(count("src/map/a.h", "#include \"mesh/a.h\"\n"), 1u) << "upward";
    EXPECT_EQ(count("src/mesh/a.cpp", "  #  include \"export/ply.h\"\n"), 1u) << "sideways";
    EXPECT_EQ(count("src/export/a.cpp", "#include \"mesh/a.h\"\n"), 1u) << "sideways";
    EXPECT_EQ(count("src/datasets/a.cpp", "#include \"capture/source.h\"\n#include \"core/se3.h\"\n"), 0u);
    EXPECT_EQ(count("src/capture/a.h", "#include \"datasets/open.h\"\n"), 1u) << "upward";
    EXPECT_EQ(count("platform/v4l2/a.cpp", "#include \"platform/v4l2/b.h\"\n#include \"capture/source.h\"\n"),
              0u);
    EXPECT_EQ(count("platform/v4l2/a.cpp", "#include \"platform/usb/b.h\"\n"), 1u) << "another back end";
    EXPECT_EQ(count("platform/v4l2/a.cpp", "#include \"datasets/open.h\"\n"), 1u) << "sideways";
    EXPECT_EQ(count("src/map/a.h", "#include \"chunk.h\"\n"), 1u) << "no room";
    EXPECT_EQ(count("src/map/a.h", "#include \"../core/status.h\"\n"), 1u) << "relative";
    EXPECT_EQ(count("src/map/a.h", "#include \"attic/a.h\"\n"), 1u) << "unknown room";
    EXPECT_EQ(count("src/attic/a.h", ""), 1u) << "a file in an unknown room";
    EXPECT_EQ(count("src/map/a.h", "#include \"burin/burin.h\"\n"), 1u) << "the interface from below";
    EXPECT_EQ(count("src/api/a.cpp", "#include \"burin/burin.h\"\n#include \"session/a.h\"\n"), 0u);
    EXPECT_EQ(count("include/burin/a.h", "#include \"burin/burin.h\"\n#include <stdint.h>\n"), 0u);
    EXPECT_EQ(count("include/burin/a.h", "#include \"core/status.h\"\n"), 1u)
        << "the interface must stand alone";
    EXPECT_EQ(count("src/simd/a.cpp", "#include \"hwy/foreach_target.h\"\n#include <hwy/highway.h>\n"), 0u);
    EXPECT_EQ(count("src/session/a.cpp", "#include <nlohmann/json.hpp>\n"), 1u)
        << "a tool's library in the runtime";
    EXPECT_EQ(count("src/cli/a.cpp", "#include <nlohmann/json.hpp>\n#include \"api/a.h\"\n"), 0u);
}

// Longer files than this are split, or named here with the reason. Tables count: they too are read by
// people.
constexpr int kMaxLines = 400;
const std::map<std::string, const char*> kLongFiles = {
    {"include/burin/burin.h",
     "the interface is one header, and most of it is what each function says of itself"},
};

TEST(Layering, FilesStayShort) {
    for (const auto& file : sources()) {
        const std::string text = read(fs::path(BURIN_SOURCE_DIR) / file);
        const auto lines = std::count(text.begin(), text.end(), '\n');
        if (kLongFiles.count(file))
            EXPECT_GT(lines, kMaxLines) << file << " is short again: take it off the list";
        else
            EXPECT_LE(lines, kMaxLines) << file << " has " << lines << " lines";
    }
    for (const auto& [file, reason] : kLongFiles)
        EXPECT_TRUE(fs::exists(fs::path(BURIN_SOURCE_DIR) / file)) << file << " (" << reason << ") is gone";
}

}  // namespace
