// SPDX-License-Identifier: MIT
// `burin` at work: what it writes and prints for good input.
#include <gtest/gtest.h>

#include <cmath>

#include "cli_runner.h"
#include "export/ply.h"

namespace burin {
namespace {

namespace fs = std::filesystem;

class Cli : public testing::Test {
  protected:
    Cli() { write_sequence(folder_, 4); }
    Ran fuse(const std::string& out, std::vector<std::string> more = {}) const {
        std::vector<std::string> all = {"fuse", folder_.path(), "-o", folder_.path(out), "--voxel", "0.02"};
        all.insert(all.end(), more.begin(), more.end());
        return run_burin(all);
    }
    nlohmann::json report(const std::string& out) const {
        return parse_json(read_bytes(folder_.path(out + "/report.json")));
    }
    std::string path(const std::string& name) const { return folder_.path(name); }

    TempFolder folder_;
};

TEST_F(Cli, FuseWritesMeshMapAndReport) {
    const Ran ran = fuse("out");
    EXPECT_EQ(ran.exit, 0);
    EXPECT_EQ(ran.err, "") << "silent when piped";
    EXPECT_EQ(listing(path("out")), "map.burin mesh.ply report.json");
    const auto mesh = read_ply(path("out/mesh.ply"));
    ASSERT_TRUE(mesh.ok()) << mesh.status().text();
    EXPECT_GT(mesh->triangles.size(), 5000u);
    const AnalyticScene scene = ball_and_wall();
    double sum = 0, without_colour = 0;
    for (std::size_t i = 0; i < mesh->positions.size(); ++i) {
        sum += std::fabs(scene.distance(to_double(mesh->positions[i])));
        const bool white =
            mesh->colours[i][1] == 255;  // far from every reading's own distance: a slanted rim
        without_colour += white;
        if (white) continue;
        ASSERT_NEAR(mesh->colours[i][0], 240, 1);
        ASSERT_NEAR(mesh->colours[i][1], 120, 1);
    }
    EXPECT_LT(sum / static_cast<double>(mesh->positions.size()), 0.3 * 0.02);
    // Edges of up to 7 voxels carry vertices, colour is kept within 2: rims go without.
    EXPECT_LT(without_colour / static_cast<double>(mesh->positions.size()), 0.005);
}

TEST_F(Cli, JsonIsOneObjectWithEveryKey) {
    const Ran ran = fuse("out", {"--json"});
    ASSERT_EQ(ran.exit, 0) << ran.err;
    EXPECT_EQ(std::count(ran.out.begin(), ran.out.end(), '\n'), 1);
    const nlohmann::json printed = parse_json(ran.out), r = report("out");
    EXPECT_EQ(printed, r);
    for (const char* key : {"frames", "tracked", "stages", "chunks", "memory", "voxel_m", "truncation_m",
                            "threads", "simd", "map_hash", "version"})
        EXPECT_TRUE(r.contains(key)) << key;
    for (const char* stage : {"depth", "track", "integrate", "mesh", "planes"})
        for (const char* key : {"p50_ms", "p95_ms", "mean_ms"})
            EXPECT_TRUE(r["stages"][stage][key].is_number()) << stage << ' ' << key;
    for (const char* key : {"live", "high_water", "capacity", "dropped", "evicted", "reloaded"})
        EXPECT_TRUE(r["chunks"][key].is_number_unsigned() || r["chunks"][key] == 0) << key;
    for (const char* key : {"budget_bytes", "arena_bytes", "peak_rss_bytes"})
        EXPECT_GT(r["memory"][key].get<std::uint64_t>(), 1000000u) << key;
    EXPECT_EQ(r["frames"], 4);
    EXPECT_EQ(r["tracked"], 4);
    EXPECT_NEAR(r["voxel_m"].get<double>(), 0.02, 1e-6);
    EXPECT_NEAR(r["truncation_m"].get<double>(), 0.08, 1e-6);
    EXPECT_EQ(r["memory"]["budget_bytes"], 256u << 20);
    EXPECT_LE(r["memory"]["arena_bytes"].get<std::uint64_t>(), 256u << 20);
    EXPECT_GT(r["stages"]["integrate"]["p50_ms"].get<double>(), 0);
    EXPECT_EQ(r["map_hash"].get<std::string>().size(), 16u);
    EXPECT_EQ(r["version"], burin_version());
    EXPECT_GT(r["chunks"]["live"], 100);
    EXPECT_EQ(r["chunks"]["dropped"], 0);
}

TEST_F(Cli, TheHashIsTheMapsOwn) {
    ASSERT_EQ(fuse("one", {"--threads", "1"}).exit, 0);
    ASSERT_EQ(fuse("two", {"--threads", "2", "--budget", "20MiB"}).exit, 0);
    EXPECT_EQ(report("one")["map_hash"], report("two")["map_hash"]);
    EXPECT_EQ(read_bytes(path("one/mesh.ply")), read_bytes(path("two/mesh.ply")));
    burin_file_info info;
    ASSERT_EQ(burin_file_probe(path("one/map.burin").c_str(), &info), BURIN_OK);
    char hex[17];
    std::snprintf(hex, sizeof hex, "%016llx", static_cast<unsigned long long>(info.hash));
    EXPECT_EQ(report("one")["map_hash"], hex);
    EXPECT_EQ(info.frames, 4u);
}

TEST_F(Cli, ResumeGoesOnWhereTheMapEnded) {
    ASSERT_EQ(fuse("all").exit, 0);
    ASSERT_EQ(fuse("first", {"--frames", ":2"}).exit, 0);
    EXPECT_EQ(report("first")["frames"], 2);
    ASSERT_EQ(fuse("second", {"--frames", "2:", "--resume", path("first/map.burin")}).exit, 0);
    EXPECT_EQ(report("second")["map_hash"], report("all")["map_hash"]);
    EXPECT_NE(report("first")["map_hash"], report("all")["map_hash"]);
}

TEST_F(Cli, ASmallBudgetFinishesAndSaysWhatItDropped) {
    const Ran ran = fuse("out", {"--min-depth", "0.3", "--budget", "1200KiB", "--json"});
    EXPECT_EQ(ran.exit, 0);
    EXPECT_EQ(ran.lines(), 1) << ran.err;
    for (const char* part : {"full", "dropped", "--budget", "1200KiB"})
        EXPECT_NE(ran.err.find(part), std::string::npos) << ran.err;
    const nlohmann::json r = report("out");
    EXPECT_GT(r["chunks"]["dropped"], 100);
    EXPECT_EQ(r["chunks"]["live"], r["chunks"]["capacity"]);
    EXPECT_EQ(r["chunks"]["high_water"], r["chunks"]["capacity"]);
    EXPECT_LE(r["memory"]["arena_bytes"], 1200u << 10);
    EXPECT_GT(read_ply(path("out/mesh.ply"))->triangles.size(), 1000u);
}

TEST_F(Cli, AStoreMakesASmallBudgetEnough) {
    ASSERT_EQ(fuse("large", {"--min-depth", "0.3"}).exit, 0);
    const std::vector<std::string> small = {"--min-depth",    "0.3",  "--budget", "1900KiB",
                                            "--store-chunks", "3000", "--store",  path("store")};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.begin(), small.begin(), small.end());
        return more;
    };
    const Ran ran = fuse("small", with({"--store-commit", "2"}));
    ASSERT_EQ(ran.exit, 0) << ran.err;
    EXPECT_EQ(ran.lines(), 0) << ran.err;
    const nlohmann::json r = report("small"), large = report("large");
    EXPECT_EQ(r["map_hash"], large["map_hash"]);
    EXPECT_EQ(r["chunks"]["dropped"], 0);
    EXPECT_GT(r["chunks"]["evicted"], 0);
    EXPECT_GT(r["chunks"]["reloaded"], 0);
    EXPECT_LE(r["memory"]["arena_bytes"].get<std::uint64_t>(), 1900u << 10);
    EXPECT_GT(large["chunks"]["live"].get<int>(), r["chunks"]["capacity"].get<int>());
    EXPECT_EQ(read_bytes(path("small/map.burin")).substr(4096),
              read_bytes(path("large/map.burin")).substr(4096));
    const auto a = read_ply(path("small/mesh.ply")), b = read_ply(path("large/mesh.ply"));
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_EQ(a->positions.size(), b->positions.size());
    EXPECT_EQ(a->triangles.size(), b->triangles.size());

    const Ran again = fuse("again", small);
    EXPECT_EQ(again.exit, 2) << "the store exists";
    EXPECT_NE(again.err.find("--store-resume"), std::string::npos) << again.err;
    ASSERT_EQ(fuse("again", with({"--store-resume", "--frames", ":1"})).exit, 0);
    EXPECT_NE(report("again")["map_hash"], r["map_hash"]) << "one frame more";
    EXPECT_EQ(fuse("none", {"--store-resume"}).exit, 2);
    EXPECT_EQ(fuse("none", {"--store-resume", "--store", path("not-there")}).exit, 2);
}

TEST_F(Cli, FormatsOptionsAndQuiet) {
    EXPECT_EQ(fuse("out", {"--format", "tum", "--quiet"}).out, "");
    EXPECT_EQ(fuse("grey", {"--no-colour"}).exit, 0);
    EXPECT_TRUE(read_ply(path("grey/mesh.ply"))->colours.empty());
    EXPECT_LT(fs::file_size(path("grey/map.burin")), fs::file_size(path("out/map.burin")) * 6 / 10);
    for (const char* name : {"mesh.obj", "mesh.glb", "mesh.stl"}) {
        EXPECT_EQ(fuse("other", {"--mesh", name}).exit, 0);
        EXPECT_GT(fs::file_size(path(std::string("other/") + name)), 100000u);
    }
    EXPECT_EQ(
        fuse("every", {"--truncation-model", "quadratic", "--weight", "inverse-z2", "--drop", "exponential",
                       "--angle-weight", "--no-carve", "--bilateral", "--edge-removal", "--stream-mesh"})
            .exit,
        0);
    EXPECT_GT(report("every")["stages"]["mesh"]["p50_ms"].get<double>(), 0);
}

TEST_F(Cli, MeshOfAMapIsThatOfFuse) {
    ASSERT_EQ(fuse("out").exit, 0);
    const Ran ran = run_burin({"mesh", path("out/map.burin"), "-o", path("again.ply"), "--json"});
    ASSERT_EQ(ran.exit, 0) << ran.err;
    EXPECT_EQ(read_bytes(path("again.ply")), read_bytes(path("out/mesh.ply")));
    const auto mesh = read_ply(path("again.ply"));
    EXPECT_EQ(parse_json(ran.out)["triangles"], mesh->triangles.size());
    ASSERT_EQ(run_burin({"mesh", path("out/map.burin"), "-o", path("none.ply"), "--min-weight", "1000"}).exit,
              0);
    EXPECT_TRUE(read_ply(path("none.ply"))->triangles.empty()) << "an empty mesh is no error";
}

TEST_F(Cli, PlanesOfASequenceAndOfAMap) {
    ASSERT_EQ(fuse("plain").exit, 0);
    const Ran ran = fuse("out", {"--planes"});
    ASSERT_EQ(ran.exit, 0) << ran.err;
    EXPECT_EQ(listing(path("out")),
              "floorplan.json floorplan.svg map.burin mesh.ply objects.json planes.json report.json");
    EXPECT_EQ(report("out")["map_hash"], report("plain")["map_hash"]);
    const Ran again = run_burin({"planes", path("plain/map.burin"), "-o", path("again")});
    ASSERT_EQ(again.exit, 0) << again.err;
    EXPECT_EQ(again.err, "");
    EXPECT_NE(again.out.find("planes.json: 1 planes"), std::string::npos) << again.out;
    EXPECT_EQ(listing(path("again")), "floorplan.json floorplan.svg mesh.ply objects.json planes.json");
    for (const char* folder : {"out", "again"}) {
        const nlohmann::json planes = parse_json(read_bytes(path(std::string(folder) + "/planes.json")));
        ASSERT_EQ(planes.size(), 1u) << "the wall behind the ball";
        const nlohmann::json& p = planes[0];
        for (const char* key : {"id", "label", "normal", "offset", "area_m2", "rms_m", "covariance",
                                "support", "polygon", "rings"})
            ASSERT_TRUE(p.contains(key)) << key;
        EXPECT_NEAR(p["normal"][2].get<double>(), -1, 1e-3);
        EXPECT_NEAR(p["offset"].get<double>(), 2, 0.004);
        EXPECT_GE(p["polygon"].size(), 4u);
        EXPECT_EQ(p["covariance"].size(), 4u);
        const auto mesh = read_ply(path(std::string(folder) + "/mesh.ply"));
        ASSERT_TRUE(mesh.ok()) << mesh.status().text();
        EXPECT_EQ(mesh->labels.size(), mesh->triangles.size());
        EXPECT_EQ(mesh->filled.size(), mesh->triangles.size());
    }
    EXPECT_TRUE(read_ply(path("plain/mesh.ply"))->filled.empty());
    ASSERT_EQ(fuse("grey", {"--no-colour"}).exit, 0);
    const Ran grey = run_burin({"planes", path("grey/map.burin"), "-o", path("grey-planes")});
    EXPECT_EQ(grey.exit, 0) << grey.err;
    EXPECT_EQ(run_burin({"planes", path("out/map.burin"), "-o", path("quiet"), "--quiet"}).out, "");
}

// Share of pixels that are not the background, and their mean.
std::pair<double, double> painted(const std::string& file) {
    Image<std::uint8_t> picture;
    const Status status = read_rgb(file, &picture);
    EXPECT_TRUE(status.ok()) << status.text();
    double count = 0, sum = 0;
    const auto& p = picture.pixels;
    for (std::size_t i = 0; i + 2 < p.size(); i += 3)
        if (p[i] != 255 || p[i + 1] != 255 || p[i + 2] != 255) {
            ++count;
            sum += p[i];
        }
    return {count / static_cast<double>(p.size() / 3), sum / std::max(count, 1.0)};
}

TEST_F(Cli, RenderMapAndMesh) {
    ASSERT_EQ(fuse("out").exit, 0);
    const Se3 T = arc_pose(1, 4);
    const Quaternion q = quaternion_of(T.R);
    char pose[200];
    std::snprintf(pose, sizeof pose, "%.9f %.9f %.9f %.9f %.9f %.9f %.9f", T.t.x, T.t.y, T.t.z, q.x, q.y, q.z,
                  q.w);
    for (const char* mode : {"shaded", "shaded-colour", "colour", "normals", "depth"})
        for (const char* input : {"out/map.burin", "out/mesh.ply"}) {
            SCOPED_TRACE(std::string(mode) + " of " + input);
            ASSERT_EQ(run_burin({"render", path(input), "-o", path("p.png"), "--mode", mode, "--size",
                                 "160x120", "--pose", pose, "--fov", "62.7"})
                          .exit,
                      0);
            const auto [share, red] = painted(path("p.png"));
            EXPECT_GT(share, 0.75);
            if (std::string(mode) == "colour") {
                EXPECT_NEAR(red, 240, 2);
            }
        }
    for (const char* input : {"out/map.burin", "out/mesh.ply"}) {
        ASSERT_EQ(
            run_burin({"render", path(input), "-o", path("overview.png"), "--size", "320x240", "--up", "-y"})
                .exit,
            0);
        EXPECT_GT(painted(path("overview.png")).first, 0.1) << "the overview shows little of the surface";
    }
    ASSERT_EQ(run_burin({"render", path("out/map.burin"), "-o", path("p.png"), "--size", "64x48",
                         "--trajectory", path("groundtruth.txt"), "--frame", "3"})
                  .exit,
              0);
    EXPECT_GT(painted(path("p.png")).first, 0.5);
}

TEST_F(Cli, EvalMeshTrajectoryAndDepth) {
    ASSERT_EQ(fuse("out").exit, 0);
    Ran ran = run_burin(
        {"eval", "mesh", path("out/mesh.ply"), path("out/mesh.ply"), "--json", "--samples", "20000"});
    ASSERT_EQ(ran.exit, 0) << ran.err;
    const nlohmann::json same = parse_json(ran.out);
    EXPECT_LT(same["accuracy"]["mean_m"].get<double>(), 1e-6);
    EXPECT_TRUE(same["topology"]["clean"].get<bool>());
    EXPECT_EQ(same["scores"][0]["f_score"], 1.0);
    ran = run_burin({"eval", "trajectory", path("groundtruth.txt"), path("groundtruth.txt"), "--json"});
    ASSERT_EQ(ran.exit, 0) << ran.err;
    EXPECT_LT(parse_json(ran.out)["ate_m"]["rmse"].get<double>(), 1e-9);
    ran = run_burin({"eval", "depth", path("out/mesh.ply"), path(""), "--json"});
    ASSERT_EQ(ran.exit, 0) << ran.err;
    EXPECT_LT(parse_json(ran.out)["median_m"].get<double>(), 0.3 * 0.02);
}

TEST(CliAlone, ConfigPrintsWhatWouldBeUsed) {
    const Ran text = run_burin({"config", "--print"});
    EXPECT_EQ(text.exit, 0);
    EXPECT_NE(text.out.find("voxel_m"), std::string::npos);
    const Ran ran =
        run_burin({"config", "--print", "--json", "--voxel", "0.01", "--budget", "64MiB", "--no-colour"});
    const nlohmann::json c = parse_json(ran.out);
    EXPECT_NEAR(c["voxel_m"].get<double>(), 0.01, 1e-7);
    EXPECT_EQ(c["budget_bytes"], 64u << 20);
    EXPECT_EQ(c["colour"], 0);
    EXPECT_LE(c["bytes"], 64u << 20);
    EXPECT_GT(c["bytes"], (64u << 20) - 5000);
    // Every field of the configuration is there.
    for (const char* key :
         {"budget_bytes", "voxel_m", "truncation_voxels", "truncation", "truncation_scale", "min_depth_m",
          "max_depth_m", "weight", "drop", "angle_weight", "max_weight", "carve", "colour", "bilateral",
          "edge_removal", "max_width", "max_height", "threads"})
        EXPECT_TRUE(c.contains(key)) << key;
}

TEST(CliAlone, HelpAndVersion) {
    EXPECT_EQ(run_burin({"--version"}).out, std::string(burin_version()) + "\n");
    for (const char* command : {"fuse", "synth", "mesh", "planes", "render", "eval", "config"}) {
        const Ran ran = run_burin({command, "--help"});
        EXPECT_EQ(ran.exit, 0);
        EXPECT_GT(ran.out.size(), 200u);
    }
}

}  // namespace
}  // namespace burin
