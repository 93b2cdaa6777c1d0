// SPDX-License-Identifier: MIT
// The oracle: the streams in tests/fuzz/corpus/fuzz_datasets_lzfse were written by the encoder of
// github.com/lzfse/lzfse, Apple's reference, built beside the project. v1_text is v2_text with its header and
// tables written plainly, which that reference's decoder accepts too; no encoder known writes this form.
#include <gtest/gtest.h>
#include <zlib.h>

#include "dataset_files.h"
#include "datasets/lzfse.h"

namespace burin {
namespace {

std::string stream(const std::string& name) {
    return read_bytes(BURIN_SOURCE_DIR "/tests/fuzz/corpus/fuzz_datasets_lzfse/" + name);
}

struct Known {
    const char* name;
    std::size_t bytes;
    unsigned crc;
};
constexpr Known kKnown[] = {
    {"v2_text", 20984, 0xb4eced23u},         {"v2_floats", 12288, 0x6f35ffbeu},
    {"lzvn_levels", 3072, 0x28ef1b01u},      {"raw_tiny", 3, 0x352441c2u},
    {"v2_many_blocks", 240000, 0xa0eedaa9u}, {"v1_text", 20984, 0xb4eced23u},
};

TEST(Lzfse, ExpandsWhatTheReferenceWrote) {
    for (const Known& known : kKnown) {
        std::string out;
        const Status status = decode_lzfse(stream(known.name), known.name, known.bytes, &out);
        ASSERT_TRUE(status.ok()) << status.text();
        EXPECT_EQ(out.size(), known.bytes) << known.name;
        EXPECT_EQ(crc32(0, reinterpret_cast<const Bytef*>(out.data()), static_cast<uInt>(out.size())),
                  known.crc)
            << known.name;
    }
}

TEST(Lzfse, BlocksOfAllKindsInOneStream) {
    std::string all, expected;
    for (const Known& known : kKnown) {
        const std::string one = stream(known.name);
        std::string out;
        ASSERT_TRUE(decode_lzfse(one, known.name, known.bytes, &out).ok());
        expected += out;
        all += one.substr(0, one.size() - 4);
    }
    std::string out;
    const Status status = decode_lzfse(all + "bvx$", "all", expected.size(), &out);
    ASSERT_TRUE(status.ok()) << status.text();
    EXPECT_TRUE(out == expected);
}

TEST(Lzfse, CutAnywhereIsAnError) {
    for (const Known& known : kKnown) {
        const std::string whole = stream(known.name);
        const std::size_t step = whole.size() / 200 + 1;
        for (std::size_t at = 0; at < whole.size(); at += step) {
            std::string out;
            const Status status = decode_lzfse(whole.substr(0, at), known.name, known.bytes, &out);
            EXPECT_EQ(status.code(), Code::format) << known.name << " at " << at;
            EXPECT_TRUE(out.empty());
        }
        std::string out;
        EXPECT_FALSE(decode_lzfse(whole + "x", known.name, known.bytes, &out).ok());
        EXPECT_FALSE(
            decode_lzfse(whole, known.name, known.bytes - 1, &out).ok());  // more than there is room for
    }
}

}  // namespace
}  // namespace burin
