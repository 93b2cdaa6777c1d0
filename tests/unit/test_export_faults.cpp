// SPDX-License-Identifier: MIT
// Bad input and failing disks: one line that says what is wrong, and nothing partial under the final name.
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <cerrno>
#include <cstring>

#include "core/atomic_file.h"
#include "export/mesh_file.h"
#include "export/ply.h"
#include "test_eval_meshes.h"
#include "test_export_files.h"

using namespace burin;
using namespace burin::testing_meshes;
using namespace burin::testing_files;

namespace {

const char* const kExtensions[] = {".ply", ".obj", ".stl", ".glb"};

void expect_one_line(const Status& status, const std::string& part) {
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(std::strchr(status.text(), '\n'), nullptr) << status.text();
    EXPECT_NE(std::strstr(status.text(), part.c_str()), nullptr) << status.text() << " should say " << part;
}

// A tiny file system, to be full.
class TinyDisk {
  public:
    explicit TinyDisk(const std::string& folder) : folder_(folder) {
        mounted_ = ::mount("tmpfs", folder.c_str(), "tmpfs", 0, "size=64k") == 0;
        error_ = errno;
    }
    ~TinyDisk() {
        if (mounted_) ::umount2(folder_.c_str(), MNT_DETACH);
    }
    bool mounted() const { return mounted_; }
    const char* why_not() const { return std::strerror(error_); }

  private:
    std::string folder_;
    bool mounted_ = false;
    int error_ = 0;
};

}  // namespace

TEST(AtomicFile, LeavesTheOldFileUntilCommit) {
    Folder folder;
    const std::string path = folder / "out.txt";
    spill(path, "old");
    spill(path + ".part", "left behind by a killed process");
    AtomicFile file;
    ASSERT_TRUE(file.open(path.c_str()).ok());
    ASSERT_TRUE(file.write("new", 3).ok());
    EXPECT_EQ(slurp(path), "old");
    ASSERT_TRUE(file.commit(true).ok());
    EXPECT_EQ(slurp(path), "new");
    EXPECT_EQ(folder.files(), 1u);
    EXPECT_EQ(file.write("x", 1).code(), Code::state);
    EXPECT_EQ(file.commit().code(), Code::state);
}

TEST(AtomicFile, DiscardsWithoutCommit) {
    Folder folder;
    spill(folder / "out.txt", "old");
    {
        AtomicFile file;
        ASSERT_TRUE(file.open((folder / "out.txt").c_str()).ok());
        ASSERT_TRUE(file.write("new", 3).ok());
        EXPECT_EQ(file.open((folder / "other.txt").c_str()).code(), Code::state);
    }
    EXPECT_EQ(slurp(folder / "out.txt"), "old");
    EXPECT_EQ(folder.files(), 1u);
    ASSERT_TRUE(write_file_atomically((folder / "out.txt").c_str(), "all", 3).ok());
    EXPECT_EQ(slurp(folder / "out.txt"), "all");
}

TEST(AtomicFile, RefusesWhatIsNoFile) {
    Folder folder;
    AtomicFile file;
    expect_one_line(file.open(folder.path().c_str()), "no regular file");
    expect_one_line(file.open("/dev/full"), "no regular file");
    expect_one_line(file.open(""), "empty");
    expect_one_line(file.open((folder / "missing/out.txt").c_str()), "No such file");
    expect_one_line(file.open(std::string(5000, 'a').c_str()), "5000 bytes");
    // A link under the part name is replaced, not followed.
    spill(folder / "victim", "untouched");
    std::filesystem::create_symlink(folder / "victim", folder / "out.txt.part");
    ASSERT_TRUE(write_file_atomically((folder / "out.txt").c_str(), "text", 4).ok());
    EXPECT_EQ(slurp(folder / "victim"), "untouched");
    EXPECT_EQ(slurp(folder / "out.txt"), "text");
    // A folder under the part name cannot be replaced.
    std::filesystem::create_directory(folder / "other.txt.part");
    expect_one_line(file.open((folder / "other.txt").c_str()), "other.txt.part");
    EXPECT_TRUE(std::filesystem::is_directory(folder / "other.txt.part"));
}

TEST(ExportFaults, UnwritablePathsAreNamed) {
    const TriangleMesh mesh = make_sphere(1, 1);
    for (const char* extension : kExtensions) {
        Folder folder;
        const std::string path = folder / ("missing/mesh" + std::string(extension));
        const Status status = write_mesh(path, mesh);
        EXPECT_EQ(status.code(), Code::io);
        expect_one_line(status, path);
        const std::string taken = folder / ("taken" + std::string(extension));
        std::filesystem::create_directory(taken);
        expect_one_line(write_mesh(taken, mesh), taken);
        EXPECT_EQ(folder.files(), 1u);
    }
}

TEST(ExportFaults, FullDiskLeavesNothing) {
    Folder folder;
    const TinyDisk disk(folder.path());
    if (!disk.mounted())
        GTEST_SKIP() << "SKIPPED, MOUNTING A TMPFS IS NOT PERMITTED HERE (" << disk.why_not()
                     << "): the full disk is not tested";
    TriangleMesh large = make_sphere(1, 5),
                 small = make_sphere(1, 1);  // 8192 triangles: over 64 KiB in any format
    paint(&large);
    paint(&small);
    for (const char* extension : kExtensions) {
        const std::string path = folder / ("mesh" + std::string(extension));
        Status status = write_mesh(path, large);
        EXPECT_EQ(status.code(), Code::io);
        expect_one_line(status, std::strerror(ENOSPC));
        expect_one_line(status, path);
        EXPECT_EQ(folder.files(), 0u) << extension;
        // What was there before survives.
        ASSERT_TRUE(write_mesh(path, small).ok());
        const std::string before = slurp(path);
        status = write_mesh(path, large);
        EXPECT_EQ(status.code(), Code::io);
        EXPECT_EQ(slurp(path), before) << extension;
        EXPECT_EQ(folder.files(), 1u) << extension;
        std::filesystem::remove(path);
    }
    const std::string bytes(100'000, 'x');
    EXPECT_EQ(write_file_atomically((folder / "report.json").c_str(), bytes.data(), bytes.size()).code(),
              Code::io);
    EXPECT_EQ(folder.files(), 0u);
}

TEST(ExportFaults, InconsistentMeshesAreRefusedByEveryWriter) {
    const auto broken = [](auto&& change) {
        TriangleMesh mesh = make_sphere(1, 1);
        paint(&mesh);
        change(mesh);
        return mesh;
    };
    const std::pair<TriangleMesh, const char*> table[] = {
        {broken([](TriangleMesh& m) { m.normals.pop_back(); }), "17 normals, expected 0 or 18"},
        {broken([](TriangleMesh& m) { m.colours.pop_back(); }), "17 colours, expected 0 or 18"},
        {broken([](TriangleMesh& m) { m.labels.pop_back(); }), "31 labels, expected 0 or 32"},
        {broken([](TriangleMesh& m) { m.filled.assign(31, 1); }),
         "31 marks of filled triangles, expected 0 or 32"},
        {broken([](TriangleMesh& m) { m.triangles[5][2] = 18; }),
         "triangle 5 uses vertex 18, expected below 18"},
        {broken([](TriangleMesh& m) { m.positions[3].y = NAN; }), "vertex 3 is"},
        {broken([](TriangleMesh& m) { m.positions[4].z = HUGE_VALF; }), "vertex 4 is"}};
    Folder folder;
    for (const auto& [mesh, text] : table)
        for (const char* extension : kExtensions) {
            const Status status = write_mesh(folder / ("mesh" + std::string(extension)), mesh);
            EXPECT_EQ(status.code(), Code::invalid_argument);
            expect_one_line(status, text);
        }
    EXPECT_EQ(folder.files(), 0u);
}

namespace {

const std::string kHead = "ply\nformat ascii 1.0\n";
const std::string kVertices3 = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
const std::string kFaces1 = "element face 1\nproperty list uchar int vertex_indices\n";
const std::string kEnd = "end_header\n";
const std::string kPoints3 = "0 0 0\n1 0 0\n0 1 0\n";

Status status_of(const std::string& text) {
    return parse_ply({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, "bad.ply").status();
}

}  // namespace

TEST(PlyFaults, ErrorsNameFileValueAndExpectation) {
    ASSERT_TRUE(status_of(kHead + kVertices3 + kFaces1 + kEnd + kPoints3 + "3 0 1 2\n").ok());
    const std::string binary = "ply\nformat binary_little_endian 1.0\n";
    struct Case {
        std::string text, says;
    };
    const Case table[] = {
        {"", "expected a line 'ply'"},
        {"plyx\n", "expected a line 'ply'"},
        {"\x89PNG\r\n\x1a\n", "expected a line 'ply'"},
        {"ply\n", "expected 'end_header'"},
        {"ply\n" + std::string(5000, 'a'), "header line 2 does not end"},
        {"ply\nformat ascii 2.0\n" + kEnd, "version '2.0', expected 1.0"},
        {"ply\nformat utf8 1.0\n" + kEnd, "format 'utf8', expected ascii"},
        {"ply\n" + kVertices3 + kEnd, "no 'format' line"},
        {kHead + "property float x\n" + kEnd, "a property before any element"},
        {kHead + "element vertex\n" + kEnd, "count ''"},
        {kHead + "element vertex -3\n" + kEnd, "count '-3', expected a number"},
        {kHead + "element vertex 99999999999999999999\n" + kEnd, "expected a number"},
        {kHead + "element vertex 3x\n" + kEnd, "count '3x'"},
        {kHead + "element vertex 0\nelement vertex 0\n" + kEnd, "appears twice"},
        {kHead + "element vertex 3\nproperty quad x\n" + kEnd, "type 'quad'"},
        {kHead + "element vertex 3\nproperty float\n" + kEnd, "is named ''"},
        {kHead + "element vertex 3\nproperty float a\x01\n" + kEnd, "is named 'a?'"},
        {kHead + "element vertex 3\nproperty float x\nproperty float x\n" + kEnd, "'x' appears twice"},
        {kHead + "element face 0\nproperty list float int vertex_indices\n" + kEnd,
         "list count type 'float'"},
        {kHead + "nonsense here\n" + kEnd, "is 'nonsense here', expected"},
        {kHead + kEnd, "no 'vertex' element"},
        {kHead + "element vertex 1\nproperty float x\n" + kEnd + "0\n", "no x, y and z"},
        {kHead + kVertices3 + "element tristrips 1\nproperty list int int vertex_indices\n" + kEnd,
         "tristrips"},
        {kHead + kVertices3 + "element face 1\nproperty int a\n" + kEnd + kPoints3 + "1\n",
         "no list 'vertex_indices'"},
        {kHead + kVertices3 + "element face 1\nproperty list uchar float vertex_indices\n" + kEnd + kPoints3 +
             "3 0 1 2",
         "floating type"},
        {kHead + kVertices3 + kFaces1 + kEnd + "0.0 0.0 0\n1 0 0\n0 1\n", "'z' of vertex 2 is missing"},
        {kHead + kVertices3 + kFaces1 + kEnd + "0 0 0\n1 zero 0\n0 1 0\n3 0 1 2\n", "'y' of vertex 1"},
        {kHead + kVertices3 + kFaces1 + kEnd + "0 0 0\n1 0x 0\n0 1 0\n3 0 1 2\n", "'y' of vertex 1"},
        {kHead + kVertices3 + kFaces1 + kEnd + "0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n", "vertex 1 is at (nan"},
        {kHead + kVertices3 + kFaces1 + kEnd + "0 0 0\n0 0 1e300\n0 1 0\n3 0 1 2\n", "vertex 1 is at"},
        {kHead + kVertices3 + kFaces1 + kEnd + "0 0 0\n0 0 1e999\n0 1 0\n3 0 1 2\n", "vertex 1 is at"},
        {kHead + kVertices3 + kFaces1 + kEnd + kPoints3 + "3 0 1 3\n", "face 0 uses vertex 3, expected 0..2"},
        {kHead + kVertices3 + kFaces1 + kEnd + kPoints3 + "3 0 -1 2\n",
         "face 0 uses vertex -1, expected 0..2"},
        {kHead + kVertices3 + kFaces1 + kEnd + kPoints3 + "3 0 1.5 2\n", "no number of its type"},
        {kHead + kVertices3 + kFaces1 + kEnd + kPoints3 + "2 0 1\n",
         "face 0 has 2 corners, expected at least 3"},
        {kHead + kVertices3 + kFaces1 + kEnd + kPoints3 + "900 0 1\n", "has 900 entries"},
        {kHead + kVertices3 + kFaces1 + kEnd + kPoints3 + "-3 0 1 2\n", "has -3 entries"},
        {kHead + kVertices3 + kFaces1 + kEnd + kPoints3 + "3 0 1\n", "is missing or no number"},
        {kHead + kVertices3 + kFaces1 + kEnd + kPoints3, "'vertex_indices' of face 0 is missing"},
        {kHead + kVertices3 + kFaces1 + "property int label\n" + kEnd + kPoints3 + "3 0 1 2 300\n",
         "label 300"},
        {kHead + kVertices3 + kFaces1 + "property int filled\n" + kEnd + kPoints3 + "3 0 1 2 -1\n",
         "filled -1"},
        {kHead +
             "element vertex 1\nproperty float x\nproperty float y\nproperty float z\nproperty int red\n"
             "property int green\nproperty int blue\n" +
             kEnd + "0 0 0 0 0 256\n",
         "colour value 256, expected 0..255"},
        // Counts that the file cannot hold must not reserve memory.
        {binary + "element vertex 2000000000\nproperty float x\nproperty float y\nproperty float z\n" + kEnd,
         "2000000000 of element 'vertex'"},
        {binary +
             "element vertex 18446744073709551615\nproperty float x\nproperty float y\nproperty float z\n" +
             kEnd,
         "but only 0 bytes follow"},
        {binary +
             "element vertex 0\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
             "property list uint int vertex_indices\n" +
             kEnd + std::string("\xff\xff\xff\xff", 4),
         "4.29497e+09 entries"},
        {binary + kVertices3 + kEnd + std::string(35, '\0'), "only 35 bytes follow"},
    };
    for (const Case& c : table) {
        const Status status = status_of(c.text);
        EXPECT_FALSE(status.ok()) << c.text;
        expect_one_line(status, c.says);
        EXPECT_EQ(std::strncmp(status.text(), "bad.ply", 7), 0) << status.text();
    }
    expect_one_line(read_ply("/nowhere/mesh.ply").status(), "cannot open '/nowhere/mesh.ply'");
    expect_one_line(read_ply("/tmp").status(), "cannot read '/tmp'");
}

TEST(PlyFaults, EveryTruncationIsAnError) {
    Folder folder;
    TriangleMesh mesh = make_sphere(1, 1);
    paint(&mesh);
    ASSERT_TRUE(write_ply(folder / "mesh.ply", mesh).ok());
    const std::string whole = slurp(folder / "mesh.ply");
    ASSERT_TRUE(status_of(whole).ok());
    for (std::size_t size = 0; size < whole.size(); ++size)
        ASSERT_FALSE(status_of(whole.substr(0, size)).ok()) << size << " of " << whole.size();
}

TEST(PlyFaults, DamagedBytesNeverYieldAnInvalidMesh) {
    Folder folder;
    TriangleMesh mesh = make_sphere(1, 1);
    paint(&mesh);
    ASSERT_TRUE(write_ply(folder / "mesh.ply", mesh).ok());
    const std::string whole = slurp(folder / "mesh.ply");
    Random random(5);
    int accepted = 0, refused = 0;
    for (int i = 0; i < 20'000; ++i) {
        std::string damaged = whole;
        for (int k = random.below(4); k >= 0; --k)
            damaged[static_cast<std::size_t>(random.below(static_cast<int>(whole.size())))] =
                static_cast<char>(random.below(256));
        const auto read =
            parse_ply({reinterpret_cast<const std::uint8_t*>(damaged.data()), damaged.size()}, "bad.ply");
        ++(read.ok() ? accepted : refused);
        ASSERT_TRUE(!read.ok() || check_mesh(*read).ok());
    }
    EXPECT_GT(accepted, 1000);  // many bytes are only colours
    EXPECT_GT(refused, 1000);
}
