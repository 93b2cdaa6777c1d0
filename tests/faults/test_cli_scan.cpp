// SPDX-License-Identifier: MIT
// `burin scan` on a small recorded room: what it writes, goes on from, and refuses.
#include "cli_runner.h"
#include "datasets/trajectory_file.h"
#include "export/ply.h"
#include "track_helpers.h"

namespace burin {
namespace {

constexpr int kFrames = 12;

// The first frames of the room in TUM layout, 30 a second; those of `blank` have no depth.
void write_room(const TempFolder& folder, bool with_poses, const std::set<int>& blank = {}) {
    const RoomSequence& room = room_sequence();
    std::string associations;
    Trajectory truth;
    for (int i = 0; i < kFrames; ++i) {
        const auto k = static_cast<std::size_t>(i);
        Image<std::uint16_t> raw(160, 120);
        for (std::size_t p = 0; p < raw.pixels.size() && blank.count(i) == 0; ++p)
            raw.pixels[p] = static_cast<std::uint16_t>(5000 * room.depths[k].pixels[p] + 0.5f);
        for (const char* sub : {"depth", "rgb"}) std::filesystem::create_directories(folder.path(sub));
        const std::string n = std::to_string(i) + ".png";
        const View<const std::uint16_t> depth = raw.view();
        ASSERT_TRUE(write_png(folder.path("depth/" + n), depth).ok());
        ASSERT_TRUE(write_png(folder.path("rgb/" + n), room.colours[k].view()).ok());
        char stamp[30];
        std::snprintf(stamp, sizeof stamp, "%.6f", 100 + i / 30.0);
        associations += std::string(stamp) + " rgb/" + n + " " + stamp + " depth/" + n + "\n";
        truth.push_back(
            {static_cast<std::int64_t>(std::llround(std::strtod(stamp, nullptr) * 1e9)), room.poses[k]});
    }
    folder.text("associations.txt", associations);
    if (with_poses) {
        ASSERT_TRUE(write_tum_trajectory(folder.path("groundtruth.txt"), truth).ok());
    }
    const Camera c = test_camera();
    char camera[200];
    std::snprintf(camera, sizeof camera,
                  "fx %g\nfy %g\ncx %g\ncy %g\nwidth 160\nheight 120\ndepth_scale 5000\n", c.fx, c.fy, c.cx,
                  c.cy);
    folder.text("camera.txt", camera);
}

class CliScan : public testing::Test {
  protected:
    Ran scan(const std::string& out, std::vector<std::string> more = {}) const {
        std::vector<std::string> all = {"scan", folder_.path(), "-o", path(out), "--voxel", "0.01"};
        all.insert(all.end(), more.begin(), more.end());
        return run_burin(all);
    }
    nlohmann::json report(const std::string& out) const {
        return parse_json(read_bytes(path(out + "/report.json")));
    }
    // The largest distance to the room's poses, seen from `world`; the stamps tell which.
    double worst_m(const std::string& out, std::size_t count, const Se3& T_world_room = {}) const {
        const auto trajectory = read_tum_trajectory(path(out + "/trajectory.txt"));
        EXPECT_TRUE(trajectory.ok()) << trajectory.status().text();
        if (!trajectory.ok()) return 1e9;
        EXPECT_EQ(trajectory->size(), count);
        double worst = 0;
        for (const auto& pose : *trajectory) {
            const auto i = static_cast<int>(std::lround((static_cast<double>(pose.t_ns) * 1e-9 - 100) * 30));
            worst = std::max(worst, away_m(pose.T_world_camera, T_world_room * room_sequence().pose(i)));
        }
        return worst;
    }
    std::string path(const std::string& name) const { return folder_.path(name); }

    TempFolder folder_;
};

TEST_F(CliScan, PlanesOfASavedMap) {
    write_room(folder_, true);
    ASSERT_EQ(scan("out", {"--no-planes"}).exit, 0);
    EXPECT_EQ(listing(path("out")), "map.burin mesh.ply report.json trajectory.txt");
    const std::string map = path("out/map.burin");
    const Ran ran = run_burin({"planes", map, "-o", path("planes"), "--raw", "--label-colours", "--json"});
    ASSERT_EQ(ran.exit, 0) << ran.err;
    EXPECT_EQ(listing(path("planes")),
              "floorplan.json floorplan.svg mesh.ply objects.json planes.json raw.ply");
    EXPECT_EQ(read_bytes(path("planes/raw.ply")), read_bytes(path("out/mesh.ply"))) << "without planes";
    const nlohmann::json counts = parse_json(ran.out);
    EXPECT_GT(counts["planes"].get<int>(), 1);
    EXPECT_EQ(counts["planes"], parse_json(read_bytes(path("planes/planes.json"))).size());
    EXPECT_EQ(counts["objects"], parse_json(read_bytes(path("planes/objects.json"))).size());
    const auto mesh = read_ply(path("planes/mesh.ply"));
    ASSERT_TRUE(mesh.ok()) << mesh.status().text();
    EXPECT_EQ(mesh->labels.size(), mesh->triangles.size());

    // Turned upside down the plan's up follows, and it need not be of unit length.
    ASSERT_EQ(run_burin({"planes", map, "-o", path("down"), "--up", "0,0,-2"}).exit, 0);
    EXPECT_EQ(parse_json(read_bytes(path("down/floorplan.json")))["up"], (std::vector<double>{0, 0, -1}));
    const Ran none = run_burin({"planes", map, "-o", path("none"), "--up", "0,0,0"});
    EXPECT_EQ(none.exit, 2);
    EXPECT_NE(none.err.find("--up"), std::string::npos) << none.err;
}

TEST_F(CliScan, WritesTrajectoryMeshMapAndReport) {
    write_room(folder_, true);
    const Ran ran = scan("out", {"--json"});
    ASSERT_EQ(ran.exit, 0) << ran.err;
    EXPECT_EQ(listing(path("out")),
              "floorplan.json floorplan.svg map.burin mesh.ply objects.json planes.json report.json "
              "trajectory.txt");
    EXPECT_LT(worst_m("out", kFrames), 0.003);  // measured 1 mm
    const nlohmann::json r = report("out");
    EXPECT_EQ(parse_json(ran.out), r);
    EXPECT_EQ(r["frames"], kFrames);
    EXPECT_EQ(r["tracked"], kFrames);
    EXPECT_EQ(r["tracking"], (nlohmann::json{{"ok", kFrames}, {"weak", 0}, {"lost", 0}, {"relocalised", 0}}));
    for (const char* stage : {"depth", "track", "integrate"})
        EXPECT_GT(r["stages"][stage]["p50_ms"].get<double>(), 0) << stage;
    EXPECT_NEAR(r["truncation_m"].get<double>(), 0.08, 1e-6);
    const auto mesh = read_ply(path("out/mesh.ply"));
    ASSERT_TRUE(mesh.ok()) << mesh.status().text();
    double sum = 0;
    for (const Vec3f& p : mesh->positions) sum += std::fabs(tracking_room().distance(to_double(p)));
    EXPECT_LT(sum / static_cast<double>(mesh->positions.size()), 0.003);
    const Ran eval =
        run_burin({"eval", "trajectory", path("out/trajectory.txt"), path("groundtruth.txt"), "--json"});
    ASSERT_EQ(eval.exit, 0) << eval.err;
    EXPECT_LT(parse_json(eval.out)["ate_m"]["rmse"].get<double>(), 0.002);

    // Neither threads nor the budget change a byte.
    ASSERT_EQ(scan("two", {"--threads", "2", "--budget", "100MiB"}).exit, 0);
    EXPECT_EQ(read_bytes(path("two/trajectory.txt")), read_bytes(path("out/trajectory.txt")));
    EXPECT_EQ(report("two")["map_hash"], r["map_hash"]);
    for (const char* file : {"/mesh.ply", "/planes.json", "/objects.json", "/floorplan.svg"})
        EXPECT_EQ(read_bytes(path(std::string("two") + file)), read_bytes(path(std::string("out") + file)))
            << file;
    // By depth alone it is another trajectory, and the other tracker has one of its own.
    ASSERT_EQ(scan("depth", {"--no-track-colour", "--no-gyro"}).exit, 0);
    EXPECT_NE(read_bytes(path("depth/trajectory.txt")), read_bytes(path("out/trajectory.txt")));
    ASSERT_EQ(scan("icp", {"--tracker", "icp", "--frames", ":4"}).exit, 0);
    EXPECT_LT(worst_m("icp", 4), 0.003);
}

// A flag that is not given leaves the default of burin_scan_config_default alone.
TEST_F(CliScan, HasTheDefaultsOfTheInterface) {
    write_room(folder_, true);
    const auto hash = [&](const std::string& out, const std::vector<std::string>& more) {
        EXPECT_EQ(scan(out, more).exit, 0);
        return report(out)["map_hash"].get<std::string>();
    };
    const burin_config config = burin_scan_config_default();
    ASSERT_EQ(config.bilateral, 1u);
    ASSERT_EQ(config.edge_removal, 1u);
    const std::string plain = hash("plain", {});
    EXPECT_EQ(hash("same", {"--bilateral", "--edge-removal", "--truncation", "8", "--max-depth", "5"}),
              plain);
    EXPECT_NE(hash("rough", {"--no-bilateral"}), plain);
    EXPECT_NE(hash("edges", {"--no-edge-removal"}), plain);
}

TEST_F(CliScan, WithoutPosesTheWorldIsTheFirstCamera) {
    write_room(folder_, false);
    const Ran ran = scan("out");
    ASSERT_EQ(ran.exit, 0) << ran.err;
    EXPECT_LT(worst_m("out", kFrames, room_sequence().pose(0).inverse()), 0.003);
    const auto trajectory = read_tum_trajectory(path("out/trajectory.txt"));
    ASSERT_TRUE(trajectory.ok());
    EXPECT_EQ(away_m((*trajectory)[0].T_world_camera, {}), 0);
    EXPECT_EQ(report("out")["tracking"]["ok"], kFrames);
}

TEST_F(CliScan, GoesOnFromASavedMap) {
    write_room(folder_, true);
    ASSERT_EQ(scan("first", {"--frames", ":8"}).exit, 0);
    const Ran ran = scan("second", {"--frames", "4:", "--resume", path("first/map.burin")});
    ASSERT_EQ(ran.exit, 0) << ran.err;
    EXPECT_EQ(report("second")["tracking"],
              (nlohmann::json{{"ok", kFrames - 7}, {"weak", 3}, {"lost", 0}, {"relocalised", 1}}));
    EXPECT_EQ(report("second")["tracked"], kFrames - 7);
    EXPECT_LT(worst_m("second", kFrames - 4), 0.003);
    EXPECT_EQ(report("second")["map_hash"].get<std::string>().size(), 16u);
    EXPECT_NE(report("second")["map_hash"], report("first")["map_hash"]);
    // A map has its voxel size.
    expect_failure(run_burin({"scan", folder_.path(), "-o", path("third"), "--voxel", "0.02", "--resume",
                              path("first/map.burin")}),
                   2, {"first/map.burin"});
}

TEST_F(CliScan, ALostFrameHasNoPose) {
    write_room(folder_, true, {5, 6});
    const Ran ran = scan("out");
    ASSERT_EQ(ran.exit, 0) << ran.err;
    EXPECT_LT(worst_m("out", kFrames - 2), 0.003);
    EXPECT_EQ(report("out")["tracking"],
              (nlohmann::json{{"ok", kFrames - 5}, {"weak", 3}, {"lost", 2}, {"relocalised", 1}}));
    EXPECT_EQ(report("out")["tracked"], kFrames - 5);
}

TEST_F(CliScan, NothingToSeeIsAnError) {
    std::set<int> all;
    for (int i = 0; i < kFrames; ++i) all.insert(i);
    write_room(folder_, true, all);
    expect_failure(scan("out"), 1, {"none of the 12 frames could be fused", "trajectory.txt", "report.json"});
    EXPECT_EQ(report("out")["tracking"],
              (nlohmann::json{{"ok", 0}, {"weak", 0}, {"lost", kFrames}, {"relocalised", 0}}));
    EXPECT_EQ(report("out")["tracked"], 0);
    EXPECT_EQ(listing(path("out")), "report.json trajectory.txt");
}

TEST_F(CliScan, BadArguments) {
    write_room(folder_, true);
    const std::string source = folder_.path(), out = path("out");
    struct {
        std::vector<std::string> arguments, parts;
    } const cases[] = {
        {{"scan"}, {"source"}},
        {{"scan", source}, {"output"}},
        {{"scan", path("none"), "-o", out}, {"none"}},
        {{"scan", source, "-o", out, "--tracker", "kinect"}, {"--tracker", "kinect", "sdf", "icp"}},
        {{"scan", source, "-o", out, "--tracker", "none"}, {"--tracker", "none"}},
        {{"scan", source, "-o", out, "--voxel", "0"}, {"voxel"}},
        {{"scan", source, "-o", out, "--budget", "1MiB"}, {"budget", "at least"}},
        {{"scan", source, "-o", out, "--frames", "20:"}, {"12 frames"}},
        {{"scan", source, "-o", out, "--resume", path("camera.txt")}, {"camera.txt"}},
        {{"fuse", source, "-o", out, "--tracker", "sdf"}, {"--tracker"}},
    };
    for (const auto& c : cases) {
        std::string line = "burin";
        for (const std::string& a : c.arguments) line += ' ' + a;
        SCOPED_TRACE(line);
        expect_failure(run_burin(c.arguments), 2, c.parts);
        EXPECT_EQ(listing(out), "") << "output of a run that failed";
    }
    EXPECT_EQ(run_burin({"scan", "--help"}).exit, 0);
}

}  // namespace
}  // namespace burin
