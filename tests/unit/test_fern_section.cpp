// SPDX-License-Identifier: MIT
// Keyframes saved with the map: what comes back is what went in, whatever is damaged is found, and a map
// without keyframes is the file it always was.
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <string>

#include "core/hash.h"
#include "dataset_files.h"
#include "fern_helpers.h"
#include "track/fern_section.h"

namespace burin {
namespace {

// A small map with keyframes, as the tracking session has them.
struct Scan {
    explicit Scan(const FernOptions& options = {}) : fusion(test_config()), ferns(options) {
        fusion.session.keep_with_map(&section);
    }
    Status save(const std::string& path) {
        MapFileHead head = {};
        head.frames = fusion.session.frames();
        return fusion.session.save(path.c_str(), head);
    }
    Status load(const std::string& path) {
        MapFileHead head;
        BURIN_TRY(read_map_head(path.c_str(), &head));
        return fusion.session.load(path.c_str(), head);
    }
    TestSession fusion;
    TestFerns ferns;
    FernSection section{ferns.keyframes};
};

void fill(Scan& scan, std::uint32_t keyframes) {
    Image<float> depth(160, 120);
    for (int y = 50; y < 58; ++y)
        for (int x = 70; x < 80; ++x) depth.view().at(x, y) = 1.0f;
    scan.fusion.integrate(frame_of(depth, test_camera(), {}));
    Rng rng(9);
    FernKeyframes& k = scan.ferns.keyframes;
    for (std::uint32_t i = 0; i < keyframes; ++i)
        ASSERT_TRUE(k.add(k.encode(stamp(i, 0, 0, i % 5 != 4)), random_pose(rng, 3), 7 * i, 1000 * i));
}

struct MemoryWriter final : MapWriter {
    Status write(const void* data, std::size_t size) override {
        EXPECT_TRUE(size == 2048 || size == 4096) << "burin_save_to promises pieces of 2 or 4 KiB";
        bytes.append(static_cast<const char*>(data), size);
        return {};
    }
    std::string bytes;
};
struct MemoryReader final : MapReader {
    explicit MemoryReader(const std::string& from) : bytes(from) {}
    Status read(void* to, std::size_t size) override {
        if (size > bytes.size() - at) return Status::error(Code::io, "no more bytes");
        std::memcpy(to, bytes.data() + at, size);
        at += size;
        return {};
    }
    const std::string& bytes;
    std::size_t at = kMapFilePage;
};

TEST(FernSection, KeyframesComeBackWithTheMap) {
    const TempFolder folder;
    for (const std::uint32_t count : {1u, 2u, 10u, 11u, 100u}) {
        Scan one, again;
        fill(one, count);
        ASSERT_TRUE(one.save(folder.path("a")).ok());
        const Status loaded = again.load(folder.path("a"));
        ASSERT_TRUE(loaded.ok()) << loaded.text();
        const FernKeyframes &a = one.ferns.keyframes, &b = again.ferns.keyframes;
        ASSERT_EQ(b.count(), count);
        for (std::uint32_t i = 0; i < count; ++i)
            ASSERT_EQ(std::memcmp(&a.keyframe(i), &b.keyframe(i), sizeof(FernKeyframe)), 0);
        const auto before = matches(a, a.encode(stamp(3, 100)), 5),
                   after = matches(b, b.encode(stamp(3, 100)), 5);
        ASSERT_EQ(before.size(), after.size());
        for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(before[i].keyframe, after[i].keyframe);
        EXPECT_EQ(one.fusion.session.hash(), again.fusion.session.hash());
        EXPECT_EQ(again.fusion.session.frames(), 1u);
        ASSERT_TRUE(again.save(folder.path("b")).ok());
        EXPECT_EQ(read_bytes(folder.path("a")), read_bytes(folder.path("b")));
    }
}

TEST(FernSection, ThroughCallbacksTheSameBytes) {
    const TempFolder folder;
    Scan scan, again;
    fill(scan, 30);
    ASSERT_TRUE(scan.save(folder.path("map")).ok());
    MemoryWriter writer;
    MapFileHead head = {};
    head.frames = 1;
    ASSERT_TRUE(scan.fusion.session.save(writer, head, "stream", nullptr).ok());
    EXPECT_EQ(writer.bytes, read_bytes(folder.path("map")));
    const std::string more = writer.bytes + "what follows in the stream";
    for (const bool wanted : {true, false}) {
        if (!wanted) again.fusion.session.keep_with_map(nullptr);
        again.ferns.keyframes.clear();
        MemoryReader reader(more);
        ASSERT_TRUE(parse_map_head(more.data(), kMapFilePage, kAnyLength, "stream", &head).ok());
        ASSERT_TRUE(again.fusion.session.load(reader, head, "stream", nullptr).ok());
        EXPECT_EQ(reader.at, writer.bytes.size());
        EXPECT_EQ(again.ferns.keyframes.count(), wanted ? 30u : 0u);
    }
    burin_config config = test_config();
    const ApiMap plain(config);  // knows nothing of keyframes
    EXPECT_EQ(burin_load(plain.map, folder.path("map").c_str()), BURIN_OK) << burin_last_error(plain.map);
    EXPECT_EQ(plain.hash(), scan.fusion.session.hash());
}

TEST(FernSection, WithoutKeyframesTheFileIsTheOldOne) {
    const TempFolder folder;
    Scan with, without;
    without.fusion.session.keep_with_map(nullptr);
    fill(with, 0);
    fill(without, 0);
    ASSERT_TRUE(with.save(folder.path("with")).ok());
    ASSERT_TRUE(without.save(folder.path("without")).ok());
    const std::string bytes = read_bytes(folder.path("with"));
    EXPECT_EQ(bytes, read_bytes(folder.path("without")));
    EXPECT_EQ(std::string(bytes, 60, 4), std::string(4, '\0'));
    // The head, a page of index, and the chunks.
    EXPECT_EQ(bytes.size(), 8192u + 4096u * with.fusion.volume().live());

    Scan other;
    fill(other, 3);
    ASSERT_TRUE(other.load(folder.path("with")).ok());
    EXPECT_EQ(other.ferns.keyframes.count(), 0u) << "keyframes of another map";
    fill(other, 3);
    other.fusion.session.clear();
    EXPECT_EQ(other.ferns.keyframes.count(), 0u);
}

TEST(FernSection, TheFilesTestsAreTaken) {
    const TempFolder folder;
    FernOptions options;
    options.ferns = 300;
    options.min_depth_m = 0.5f;
    options.max_depth_m = 6;
    Scan one(options), usual;
    fill(one, 10);
    ASSERT_TRUE(one.save(folder.path("map")).ok());
    ASSERT_TRUE(usual.load(folder.path("map")).ok());
    EXPECT_EQ(usual.ferns.keyframes.ferns(), 300u);
    const FernKeyframes& k = usual.ferns.keyframes;
    for (std::uint32_t i = 0; i < 10; ++i)
        EXPECT_EQ(k.least_dissimilarity(k.encode(stamp(i, 0, 0, i % 5 != 4))), 0.0f);
    usual.fusion.session.clear();
    EXPECT_EQ(k.ferns(), 500u);
}

TEST(FernSection, MoreThanThereIsRoomForAreThinned) {
    const TempFolder folder;
    Scan one;
    fill(one, 60);
    ASSERT_TRUE(one.save(folder.path("map")).ok());
    FernOptions few;
    few.capacity = 16;
    Scan a(few), b(few);
    ASSERT_TRUE(a.load(folder.path("map")).ok());
    ASSERT_TRUE(b.load(folder.path("map")).ok());
    ASSERT_EQ(a.ferns.keyframes.count(), 16u);
    for (std::uint32_t i = 0; i < 16; ++i)
        EXPECT_EQ(a.ferns.keyframes.keyframe(i).frame, b.ferns.keyframes.keyframe(i).frame);
}

class DamagedKeyframes : public testing::Test {
  protected:
    DamagedKeyframes() : path_(folder_.path("map.burin")) {
        fill(scan_, 12);
        EXPECT_TRUE(scan_.save(path_).ok());
        bytes_ = read_bytes(path_);
        section_ = bytes_.size() - kSection;
    }
    // Loading fails with one line that names the file, and leaves nothing.
    Code load(const std::string& bytes) {
        std::ofstream(path_, std::ios::binary | std::ios::trunc) << bytes;
        const Status status = into_.load(path_);
        if (status.ok()) return Code::ok;
        EXPECT_EQ(std::string(status.text()).rfind(path_, 0), 0u) << status.text();
        EXPECT_EQ(std::strchr(status.text(), '\n'), nullptr) << status.text();
        return status.code();
    }
    // With the digest that would be right.
    std::string sealed(std::string bytes) const {
        std::uint64_t h = 0;
        for (std::size_t at = section_; at < bytes.size(); at += kMapFilePage)
            h = hash_bytes(bytes.data() + at, kMapFilePage - (at + kMapFilePage == bytes.size() ? 8 : 0), h);
        std::memcpy(&bytes[bytes.size() - 8], &h, sizeof h);
        return bytes;
    }
    template <class T>
    std::string with(std::size_t at, T value) const {
        std::string bytes = bytes_;
        std::memcpy(&bytes[section_ + at], &value, sizeof value);
        return sealed(bytes);
    }

    static constexpr std::size_t kSection = 2 * kMapFilePage;  // 32 + 12 * 376 bytes
    TempFolder folder_;
    Scan scan_, into_;
    std::string path_, bytes_;
    std::size_t section_ = 0;
};

TEST_F(DamagedKeyframes, AnyByteThatChangedIsFound) {
    ASSERT_EQ(load(bytes_), Code::ok);
    ASSERT_EQ(into_.ferns.keyframes.count(), 12u);
    ASSERT_EQ(load(sealed(bytes_)), Code::ok) << "the test's own digest is wrong";
    std::fstream file(path_, std::ios::binary | std::ios::in | std::ios::out);
    const auto put = [&](std::size_t at, char byte) {
        file.seekp(static_cast<std::streamoff>(at));
        file.put(byte);
        file.flush();
    };
    Rng rng(72);
    for (std::size_t i = section_; i < bytes_.size(); ++i) {
        put(i, static_cast<char>(bytes_[i] ^ (1 << rng.below(8))));
        const Status status = into_.load(path_);
        put(i, bytes_[i]);
        const bool version = i >= section_ + 8 && i < section_ + 12;
        ASSERT_EQ(status.code(), version ? Code::unsupported : Code::format)
            << "byte " << i - section_ << " of the section: " << status.text();
        ASSERT_EQ(into_.ferns.keyframes.count(), 0u);
        ASSERT_EQ(into_.fusion.volume().live(), 0u);
        // Also by who does not look at keyframes.
        if (i % 64 != 0) continue;
        put(i, static_cast<char>(bytes_[i] ^ 1));
        into_.fusion.session.keep_with_map(nullptr);
        EXPECT_EQ(into_.load(path_).code(), Code::format);
        into_.fusion.session.keep_with_map(&into_.section);
        put(i, bytes_[i]);
    }
    EXPECT_TRUE(into_.load(path_).ok());
    EXPECT_EQ(into_.ferns.keyframes.count(), 12u);
}

TEST_F(DamagedKeyframes, AnyLengthButTheRightOneIsFound) {
    for (std::size_t cut = 1; cut <= kSection; cut += cut < 32 ? 1 : 377)
        ASSERT_EQ(load(bytes_.substr(0, bytes_.size() - cut)), Code::format) << cut;
    EXPECT_EQ(load(bytes_ + '\0'), Code::format);
    EXPECT_EQ(load(bytes_ + std::string(4096, '\0')), Code::format);
}

TEST_F(DamagedKeyframes, WhatIsSealedButImpossibleIsRefused) {
    constexpr std::size_t kFirst = 32, kPose = kFirst + 264, kTranslation = kPose + 72;
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();
    const std::string cases[] = {
        with(0, 'X'),  // whose section it is
        with(12, 0u),
        with(12, 513u),
        with(12, 65536u),  // ferns
        with(12, 100u),    // fewer than there are bits of
        with(16, 4000u),
        with(20, 70000u),  // range of depth
        with(24, 11u),
        with(24, 13u),
        with(24, ~0u),  // keyframes
        with(28, 1u),
        with(kFirst + 63, std::uint8_t{0x80}),  // a bit of fern 511
        with(kFirst + 256, 0u),
        with(kFirst + 256, 4u),  // content
        with(kFirst + 260, 1u),
        with(kPose, nan),
        with(kPose, 2.0),
        with(kTranslation, nan),
        with(kTranslation + 8, inf),
        with(kTranslation + 16, 1e8),
        with(kTranslation + 11 * 376, -inf),
        with(kFirst + 12 * 376, std::uint8_t{1}),  // behind the last
        with(kSection - 9, std::uint8_t{1}),
    };
    for (const std::string& bytes : cases) {
        EXPECT_EQ(load(bytes), Code::format) << &bytes - cases;
        EXPECT_EQ(into_.ferns.keyframes.count(), 0u);
        EXPECT_EQ(into_.fusion.volume().live(), 0u);
    }
    EXPECT_EQ(load(with(8, 2u)), Code::unsupported) << "another version of the tests";
    EXPECT_EQ(load(with(kTranslation, 0.25)), Code::ok) << "the offsets of this test are wrong";
    EXPECT_EQ(into_.ferns.keyframes.keyframe(0).T_world_camera.t.x, 0.25);
}

// --------------------------------------------------------------------------------------- of the map's own
// part

// Saves and loads so many bytes, whatever it was asked for.
struct Odd final : MapExtra {
    std::uint32_t bytes() const override { return announced; }
    Status save(MapWriter& writer) const override {
        for (std::size_t i = 0; i < writes; ++i) BURIN_TRY(writer.write("x", 1));
        return {};
    }
    void clear() override { cleared = true; }
    Status load(MapReader& reader, std::uint32_t, const char*) override {
        cleared = false;
        char c;
        for (std::size_t i = 0; i < reads; ++i) BURIN_TRY(reader.read(&c, 1));
        return {};
    }
    std::uint32_t announced = 0;
    std::size_t writes = 0, reads = 0;
    bool cleared = false;
};

TEST(MapExtra, PagesEndWhereTheyShould) {
    for (const std::uint32_t size : {1u, 4087u, 4088u, 4089u, 4096u, 4097u, 8184u, 8185u}) {
        Odd odd;
        odd.announced = size;
        odd.writes = odd.reads = size;
        MemoryWriter writer;
        ASSERT_TRUE(save_extra(odd, writer, "map").ok());
        EXPECT_EQ(writer.bytes.size(), extra_section_bytes(size));
        EXPECT_EQ(writer.bytes.size(), (size + 8 + 4095) / 4096 * 4096);
        MemoryReader reader(writer.bytes);
        reader.at = 0;
        ASSERT_TRUE(load_extra(&odd, size, reader, "map").ok());
        EXPECT_EQ(reader.at, writer.bytes.size());
        EXPECT_FALSE(odd.cleared);
        for (const std::size_t wrong : {size - 1, size + 1}) {
            reader.at = 0;
            odd.reads = wrong;
            EXPECT_EQ(load_extra(&odd, size, reader, "map").code(), Code::format) << size << " " << wrong;
            EXPECT_TRUE(odd.cleared);
            odd.writes = wrong;
            MemoryWriter nowhere;
            EXPECT_EQ(save_extra(odd, nowhere, "map").code(), Code::state);
        }
    }
    EXPECT_EQ(extra_section_bytes(0), 0u);
}

}  // namespace
}  // namespace burin
