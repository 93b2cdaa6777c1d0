// SPDX-License-Identifier: MIT
// The reader in docs/recording.md, as it stands there, sees in a recording what the C++ reader sees.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdio>
#include <fstream>
#include <set>

#include "capture/crc32.h"
#include "emulated.h"
#include "unit/recording_rig.h"

namespace burin {
namespace {

std::string script() {
    std::ifstream in(std::string(BURIN_SOURCE_DIR) + "/docs/recording.md");
    std::string code;
    bool inside = false;
    for (std::string line; std::getline(in, line);) {
        if (line == "```") inside = false;
        if (inside) code += line + "\n";
        if (line == "```python") inside = true;
    }
    return code;
}

// The first Python that has numpy; empty when there is none.
std::string find_python() {
    for (const char* python : {"python3", "/usr/bin/python3"})
        if (std::system((std::string(python) + " -c 'import numpy' >/dev/null 2>&1").c_str()) == 0)
            return python;
    return {};
}

std::string output_of(const std::string& command) {
    std::FILE* pipe = ::popen(command.c_str(), "r");
    std::string text;
    char block[4096];
    for (std::size_t n; (n = std::fread(block, 1, sizeof block, pipe)) > 0;) text.append(block, n);
    const int status = ::pclose(pipe);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << text;
    return text;
}

// What the script prints, by the C++ reader: offset, stream, sequence, t_ns, CRC of the pixels (of jpeg the
// file) of each image in the order of the file.
std::string expected(const std::string& path) {
    RecordingReader reader;
    EXPECT_TRUE(reader.open(path.c_str()).ok());
    RecordedImages images;
    EXPECT_TRUE(images.reserve(reader).ok());
    std::set<std::pair<std::uint64_t, int>> all;
    for (int i = 0; i < reader.frame_count(); ++i)
        for (int k = 0; k < kStreamKinds; ++k)
            if (reader.frame(i).recorded.images[k] != 0) all.insert({reader.frame(i).recorded.images[k], k});
    std::string text;
    for (const auto& [offset, k] : all) {
        const StreamInfo& s = reader.info().streams[k];
        std::vector<std::uint8_t> pixels(RecordedImages::image_room(s)), payload(reader.max_payload());
        RecordHead head;
        Camera camera;
        std::size_t bytes = 0;
        EXPECT_TRUE(reader.read_image(offset, &head, &camera, payload.data(), &bytes).ok());
        std::uint32_t crc = crc32(payload.data(), bytes);
        if (head.codec != ImageCodec::jpeg) {
            EXPECT_TRUE(
                images.read(reader, offset, static_cast<StreamKind>(k), &head, &camera, pixels.data()).ok());
            crc = crc32(pixels.data(), s.image_bytes);
        }
        char line[200];
        std::snprintf(line, sizeof line, "%llu %d %llu %lld %u\n", static_cast<unsigned long long>(offset), k,
                      static_cast<unsigned long long>(head.sequence), static_cast<long long>(head.t_ns), crc);
        text += line;
    }
    return text;
}

TEST(RecordingPython, TheReaderOfTheDocsReadsIt) {
    if (kEmulated) GTEST_SKIP() << "an emulated machine has no Python";
    const std::string python = find_python(), code = script();
    if (python.empty()) GTEST_SKIP() << "NO PYTHON WITH NUMPY: the reader of docs/recording.md was not tried";
    ASSERT_LE(std::count(code.begin(), code.end(), '\n'), 30);
    const TempFolder folder;
    const std::string reader = folder.text("reader.py", code);
    for (const RecordedColour colour : {RecordedColour::lossless, RecordedColour::raw, RecordedColour::jpeg})
        for (const auto& [width, height] : {std::pair(16, 12), {121, 35}}) {
            // Both lossless codecs, and images small enough to be raw.
            RecordingOptions options = rig_options();
            options.colour = colour;
            const DeviceInfo info = rig_device(width, height);
            const std::string path =
                folder.path(std::to_string(width) + std::to_string(static_cast<int>(colour)));
            RecordingWriter writer;
            ASSERT_TRUE(writer.open(path.c_str(), "", info, options).ok());
            for (int n = 0; n < 12; ++n) ASSERT_TRUE(add_rig_frame(writer, info, n).ok());
            ASSERT_TRUE(writer.close().ok());
            const std::string file = path + "/" + kRecordingName, want = expected(file);
            EXPECT_GT(std::count(want.begin(), want.end(), '\n'), 30);
            EXPECT_EQ(output_of(python + " " + reader + " " + file + " 2>&1"), want);
        }
}

}  // namespace
}  // namespace burin
