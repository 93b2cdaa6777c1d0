// SPDX-License-Identifier: MIT
// What `burin` does with bad input and bad output: exit 2 or 1, one line that says what is wrong, nothing
// half done.
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <functional>

#include "cli_runner.h"

namespace burin {
namespace {

namespace fs = std::filesystem;

struct Spoiled {
    const char* what;
    std::function<void(const TempFolder&)> spoil;
    std::vector<std::string> parts;
};

TEST(CliFaults, BadDatasets) {
    const Spoiled cases[] = {
        {"truncated PNG",
         [](const TempFolder& f) {
             fs::resize_file(f.path("depth/1.png"), fs::file_size(f.path("depth/1.png")) / 2);
         },
         {"depth/1.png"}},
        {"depth image gone", [](const TempFolder& f) { fs::remove(f.path("depth/2.png")); }, {"depth/2.png"}},
        {"8-bit depth",
         [](const TempFolder& f) {
             const Image<std::uint8_t> image(160, 120, 1, 50);
             ASSERT_TRUE(
                 write_png(f.path("depth/0.png"), static_cast<View<const std::uint8_t>>(image.view())).ok());
         },
         {"depth/0.png", "16"}},
        {"another size",
         [](const TempFolder& f) {
             const Image<std::uint16_t> image(80, 60, 1, 5000);
             ASSERT_TRUE(
                 write_png(f.path("depth/1.png"), static_cast<View<const std::uint16_t>>(image.view())).ok());
         },
         {"depth/1.png", "80", "160"}},
        {"NaN pose",
         [](const TempFolder& f) { f.text("groundtruth.txt", "1.0 nan 0 0 0 0 0 1\n"); },
         {"groundtruth.txt"}},
        {"quaternion of length 2",
         [](const TempFolder& f) { f.text("groundtruth.txt", "1.0 0 0 0 0 0 0 2\n"); },
         {"groundtruth.txt", "2"}},
        {"poses of another time",
         [](const TempFolder& f) { f.text("groundtruth.txt", "1000.0 0 0 0 0 0 0 1\n"); },
         {"pose", "ground truth"}},
        {"negative focal length",
         [](const TempFolder& f) {
             f.text("camera.txt",
                    "fx -131\nfy 131\ncx 79.5\ncy 59.5\nwidth 160\nheight 120\ndepth_scale 5000\n");
         },
         {"camera.txt", "-131"}},
        {"depth scale 0",
         [](const TempFolder& f) {
             f.text("camera.txt", "fx 131\nfy 131\ncx 79.5\ncy 59.5\nwidth 160\nheight 120\ndepth_scale 0\n");
         },
         {"camera.txt", "0"}},
        {"zero frames",
         [](const TempFolder& f) { f.text("associations.txt", "# nothing\n"); },
         {"associations.txt"}},
        {"no trajectory",
         [](const TempFolder& f) { fs::remove(f.path("groundtruth.txt")); },
         {"groundtruth.txt"}},
        {"a file for a folder", [](const TempFolder& f) { fs::remove_all(f.path("depth")); }, {"depth"}},
    };
    for (const Spoiled& c : cases) {
        SCOPED_TRACE(c.what);
        const TempFolder folder, output;
        write_sequence(folder, 3);
        c.spoil(folder);
        const Ran ran = run_burin({"fuse", folder.path(), "-o", output.path("out"), "--voxel", "0.02"});
        expect_failure(ran, 2, c.parts);
        EXPECT_EQ(listing(output.path("out")), "") << "output of a run that failed";
    }
}

TEST(CliFaults, BadArguments) {
    const TempFolder folder;
    write_sequence(folder, 2);
    const std::string out = folder.path("out");
    struct {
        std::vector<std::string> arguments;
        std::vector<std::string> parts;
    } const cases[] = {
        {{}, {"fuse", "render"}},
        {{"fuse"}, {}},
        {{"fuse", folder.path("none"), "-o", out}, {"none"}},
        {{"fuse", "/dev/null", "-o", out}, {"/dev/null"}},
        {{"fuse", folder.path()}, {"output"}},
        {{"fuse", folder.path(), "-o", out, "--nonsense"}, {"--nonsense"}},
        {{"fuse", folder.path(), "-o", out, "--format", "betamax"}, {"betamax", "tum"}},
        {{"fuse", folder.path(), "-o", out, "--format", "7scenes"}, {}},
        {{"fuse", folder.path(), "-o", out, "--budget", "lots"}, {"--budget", "lots"}},
        {{"fuse", folder.path(), "-o", out, "--budget", "-5MiB"}, {"--budget", "-5MiB"}},
        {{"fuse", folder.path(), "-o", out, "--budget", "nan"}, {"--budget"}},
        {{"fuse", folder.path(), "-o", out, "--budget", "1KiB"}, {"budget", "1024", "at least"}},
        {{"fuse", folder.path(), "-o", out, "--voxel", "0"}, {"voxel", "0.0005"}},
        {{"fuse", folder.path(), "-o", out, "--voxel", "abc"}, {"--voxel", "abc"}},
        {{"fuse", folder.path(), "-o", out, "--voxel", "nan"}, {"voxel"}},
        {{"fuse", folder.path(), "-o", out, "--max-depth", "400"}, {"max_depth", "400"}},
        {{"fuse", folder.path(), "-o", out, "--threads", "0"}, {"threads", "0"}},
        {{"fuse", folder.path(), "-o", out, "--threads", "-1"}, {"threads"}},
        {{"fuse", folder.path(), "-o", out, "--weight", "heavy"}, {"--weight", "heavy", "inverse-z2"}},
        {{"fuse", folder.path(), "-o", out, "--frames", "5"}, {"--frames", "5"}},
        {{"fuse", folder.path(), "-o", out, "--frames", "1:1"}, {"--frames", "1:1"}},
        {{"fuse", folder.path(), "-o", out, "--frames", "9:"}, {"2 frames", "9"}},
        {{"fuse", folder.path(), "-o", out, "--frames", "a:b"}, {"--frames"}},
        {{"fuse", folder.path(), "-o", out, "--mesh", "mesh.xyz"}, {"mesh.xyz"}},
        {{"fuse", folder.path(), "-o", out, "--resume", folder.path("camera.txt")}, {"camera.txt"}},
        {{"mesh", folder.path("none.burin"), "-o", folder.path("m.ply")}, {"none.burin"}},
        {{"mesh", folder.path("camera.txt"), "-o", folder.path("m.ply")}, {"camera.txt"}},
        {{"render", folder.path("none.ply"), "-o", folder.path("p.png")}, {"none.ply"}},
        {{"render", folder.path("camera.txt"), "-o", folder.path("p.png"), "--size", "0x5"},
         {"--size", "0x5"}},
        {{"render", folder.path("camera.txt"), "-o", folder.path("p.png"), "--mode", "pretty"},
         {"--mode", "pretty"}},
        {{"eval", "mesh", folder.path("none.ply"), folder.path("none.ply")}, {"none.ply"}},
        {{"eval", "trajectory", folder.path("none.txt"), folder.path("groundtruth.txt")}, {"none.txt"}},
        {{"eval", "trajectory", folder.path("groundtruth.txt"), folder.path("camera.txt")}, {"camera.txt"}},
        {{"config", "--print", "--voxel", "7"}, {"voxel"}},
        {{"dance"}, {"dance"}},
    };
    for (const auto& c : cases) {
        std::string line = "burin";
        for (const std::string& a : c.arguments) line += ' ' + a;
        SCOPED_TRACE(line);
        expect_failure(run_burin(c.arguments), 2, c.parts);
        EXPECT_EQ(listing(out), "") << "output of a run that failed";
        EXPECT_FALSE(fs::exists(folder.path("m.ply")) || fs::exists(folder.path("p.png")));
    }
}

TEST(CliFaults, UnwritableOutput) {
    const TempFolder folder;
    write_sequence(folder, 2);
    folder.text("file", "precious");
    for (const std::string& out :
         {folder.path("file"), folder.path("file/below"), std::string("/proc/burin")}) {
        SCOPED_TRACE(out);
        expect_failure(run_burin({"fuse", folder.path(), "-o", out, "--voxel", "0.02"}), 1, {out});
    }
    EXPECT_EQ(read_bytes(folder.path("file")), "precious");
    ASSERT_EQ(run_burin({"fuse", folder.path(), "-o", folder.path("out"), "--voxel", "0.02", "--quiet"}).exit,
              0);
    const std::string map = folder.path("out/map.burin");
    expect_failure(run_burin({"mesh", map, "-o", "/proc/mesh.ply"}), 1, {"/proc/mesh.ply"});
    expect_failure(run_burin({"mesh", map, "-o", "/dev/full"}), 2, {"/dev/full"});  // no known ending
    expect_failure(run_burin({"render", map, "-o", "/proc/picture.png", "--size", "64x48"}), 1,
                   {"/proc/picture.png"});
}

TEST(CliFaults, Planes) {
    const TempFolder folder;
    write_sequence(folder, 2);
    ASSERT_EQ(run_burin({"fuse", folder.path(), "-o", folder.path("out"), "--voxel", "0.02", "--quiet"}).exit,
              0);
    const std::string map = folder.path("out/map.burin"), out = folder.path("planes");
    std::string bytes = read_bytes(map);
    folder.text("short.burin", bytes.substr(0, bytes.size() / 2));
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
    folder.text("damaged.burin", bytes);
    folder.text("file", "precious");
    struct {
        std::vector<std::string> arguments;
        int exit;
        std::vector<std::string> parts;
    } const cases[] = {
        {{"planes"}, 2, {}},
        {{"planes", map}, 2, {"output"}},
        {{"planes", folder.path("none.burin"), "-o", out}, 2, {"none.burin"}},
        {{"planes", folder.path("camera.txt"), "-o", out}, 2, {"camera.txt", "map"}},
        {{"planes", folder.path("out/mesh.ply"), "-o", out}, 2, {"mesh.ply", "map"}},
        {{"planes", folder.path(), "-o", out}, 2, {folder.path()}},
        {{"planes", folder.path("short.burin"), "-o", out}, 2, {"short.burin"}},
        {{"planes", folder.path("damaged.burin"), "-o", out}, 2, {"damaged.burin"}},
        {{"planes", map, "-o", out, "--threads", "0"}, 2, {"threads"}},
        {{"planes", map, "-o", folder.path("file")}, 1, {"file"}},
        {{"planes", map, "-o", "/proc/burin"}, 1, {"/proc/burin"}},
    };
    for (const auto& c : cases) {
        std::string line = "burin";
        for (const std::string& a : c.arguments) line += ' ' + a;
        SCOPED_TRACE(line);
        expect_failure(run_burin(c.arguments), c.exit, c.parts);
        EXPECT_EQ(listing(out), "") << "output of a run that failed";
    }
    EXPECT_EQ(read_bytes(folder.path("file")), "precious");
}

TEST(CliFaults, FullDisk) {
    const TempFolder folder;
    write_sequence(folder, 3);
    const std::string disk = folder.path("disk");
    fs::create_directory(disk);
    if (::mount("burin-test", disk.c_str(), "tmpfs", 0, "size=64k") != 0)
        GTEST_SKIP() << "SKIPPED: no right to mount a small tmpfs";
    {
        const Ran ran = run_burin({"fuse", folder.path(), "-o", disk, "--voxel", "0.01"});
        expect_failure(ran, 1, {disk});
        EXPECT_EQ(listing(disk), "") << "the mesh does not fit, so nothing may be left";
    }
    std::ofstream(disk + "/mesh.ply") << "old";
    {
        const Ran ran = run_burin({"fuse", folder.path(), "-o", disk, "--voxel", "0.01"});
        expect_failure(ran, 1, {disk});
        EXPECT_EQ(listing(disk), "mesh.ply");
        EXPECT_EQ(read_bytes(disk + "/mesh.ply"), "old");
    }
    ASSERT_EQ(run_burin({"fuse", folder.path(), "-o", folder.path("out"), "--voxel", "0.01", "--quiet"}).exit,
              0);
    std::ofstream(disk + "/filler") << std::string(60000, 'x');
    for (const char* name : {"m.ply", "m.obj", "m.glb", "m.stl"})
        expect_failure(run_burin({"mesh", folder.path("out/map.burin"), "-o", disk + "/" + name}), 1, {name});
    expect_failure(
        run_burin({"render", folder.path("out/map.burin"), "-o", disk + "/p.png", "--mode", "normals"}), 1,
        {"p.png"});
    expect_failure(run_burin({"synth", "desk", "-o", disk + "/desk", "--frames", "2", "--size", "160x120"}),
                   1, {disk});
    EXPECT_EQ(listing(disk), "filler mesh.ply");
    EXPECT_EQ(::umount(disk.c_str()), 0);
}

}  // namespace
}  // namespace burin
