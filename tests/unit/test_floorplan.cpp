// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "export/floorplan.h"
#include "test_export_files.h"

namespace burin {
namespace {

using testing_files::Folder;
using testing_files::slurp;
using testing_files::spill;

enum : std::uint8_t { kNone, kWall, kFloor, kCeiling, kTable, kSeat, kWindow, kDoor };

// An upright rectangle over the foot line a -> b, with free space on the right of it.
FloorPlanPlane upright(int id, std::uint8_t label, Vec3d a, Vec3d b, double foot, double top) {
    const Vec3d u = normalised(b - a), n = cross(u, Vec3d{0, 0, 1}), up{0, 0, 1};
    return {id, label, n, -dot(n, a), {{a + up * foot, b + up * foot, b + up * top, a + up * top}}};
}

// A room of 4 x 3 m with its floor at z = 0.5: a door, a window, a table, a chair, things.
FloorPlanInput room() {
    FloorPlanInput in;
    const double z = 0.5;
    // The walls end 10 cm before the corners, as a scan leaves them.
    in.planes.push_back(upright(0, kWall, {0.1, 3, 0}, {3.9, 3, 0}, z, z + 2.5));
    in.planes.push_back(upright(1, kWall, {4, 2.9, 0}, {4, 0.1, 0}, z, z + 2.5));
    in.planes.push_back(upright(2, kWall, {3.9, 0, 0}, {0.1, 0, 0}, z, z + 2.4));
    in.planes.push_back(upright(3, kWall, {0, 0.1, 0}, {0, 2.9, 0}, z, z + 2.5));
    in.planes.push_back(
        {4,
         kFloor,
         {0, 0, 1},
         -z,
         {{{0, 0, z}, {4, 0, z}, {4, 3, z}, {0, 3, z}}, {{1, 1, z}, {1, 2, z}, {2, 2, z}, {2, 1, z}}}});
    in.planes.push_back(upright(5, kDoor, {1, 2.97, 0}, {1.9, 2.97, 0}, z, z + 2.05));
    in.planes.push_back(
        upright(6, kDoor, {1.15, 2.96, 0}, {1.75, 2.96, 0}, z + 0.15, z + 1.9));  // its panels
    in.planes.push_back(upright(7, kWindow, {4.02, 2, 0}, {4.02, 1, 0}, z + 0.9, z + 2));
    in.planes.push_back({8,
                         kTable,
                         {0, 0, 1},
                         -z - 0.74,
                         {{{1, 1, z + 0.74}, {2, 1, z + 0.74}, {2, 2, z + 0.74}, {1, 2, z + 0.74}}}});
    in.planes.push_back({9,
                         kTable,
                         {0, 0, -1},
                         z + 0.7,  // its underside is no furniture of its own
                         {{{1, 1, z + 0.7}, {2, 1, z + 0.7}, {2, 2, z + 0.7}, {1, 2, z + 0.7}}}});
    in.planes.push_back({10,
                         kSeat,
                         {0, 0, 1},
                         -z - 0.45,
                         {{{2.5, 0.5, z + 0.45}, {2.9, 0.5, z + 0.45}, {2.9, 0.9, z + 0.45}}}});
    in.objects.push_back({kSeat, {2.4, 0.4, z}, {3, 1, z + 0.9}});             // the chair around that seat
    in.objects.push_back({kNone, {1.4, 1.4, z + 0.74}, {1.5, 1.5, z + 0.9}});  // a cup on the table
    in.objects.push_back({kNone, {3, 2, z}, {3.1, 2.1, z + 0.1}});             // a small thing on the floor
    return in;
}

double length_of(const PlanSegment& s) { return std::hypot(s.to.x - s.from.x, s.to.y - s.from.y); }

TEST(FloorPlan, OfARoom) {
    auto plan = make_floor_plan(room());
    ASSERT_TRUE(plan.ok()) << plan.status().text();
    const FloorPlan& p = *plan;
    EXPECT_NEAR(norm(p.T_plan_world * Vec3d{1, 2, 0.5} - Vec3d{1, 2, 0}), 0, 1e-12);
    ASSERT_EQ(p.walls.size(), 4u);
    for (int i = 0; i < 4; ++i) {
        const PlanSegment& wall = p.walls[static_cast<std::size_t>(i)];
        EXPECT_EQ(wall.id, i);
        EXPECT_NEAR(length_of(wall), i % 2 == 0 ? 4 : 3, 1e-9) << "corners meet";
        EXPECT_NEAR(wall.foot, 0, 1e-9);
        EXPECT_NEAR(wall.height, i == 2 ? 2.4 : 2.5, 1e-9);
    }
    EXPECT_NEAR(p.walls[0].from.x, 0, 1e-9);
    EXPECT_NEAR(p.walls[0].from.y, 3, 1e-9);
    ASSERT_EQ(p.doors.size(), 1u);
    EXPECT_EQ(p.doors[0].id, 5);
    EXPECT_NEAR(p.doors[0].from.y, 3, 1e-9) << "drawn on the wall";
    EXPECT_NEAR(length_of(p.doors[0]), 0.9, 1e-9);
    ASSERT_EQ(p.windows.size(), 1u);
    EXPECT_NEAR(p.windows[0].to.x, 4, 1e-9);
    EXPECT_NEAR(p.windows[0].foot, 0.9, 1e-9);
    ASSERT_EQ(p.free_space.size(), 1u);
    EXPECT_EQ(p.free_space[0].size(), 2u);
    ASSERT_EQ(p.furniture.size(), 2u);
    EXPECT_EQ(p.furniture[0].label, kSeat);
    EXPECT_EQ(p.furniture[0].ring.size(), 4u);
    EXPECT_EQ(p.furniture[1].label, kTable);
}

// The same room in a world whose y axis points down, turned by 30 degrees: the walls are again along the
// axes.
TEST(FloorPlan, InAnyWorldFrame) {
    FloorPlanInput in = room();
    const double c = std::sqrt(0.75), s = 0.5;
    const Se3 T{Mat3d{{1, 0, 0, 0, 0, -1, 0, 1, 0}} * Mat3d{{c, -s, 0, s, c, 0, 0, 0, 1}}, {5, -1, 2}};
    in.up_world = T.R * in.up_world;
    for (FloorPlanPlane& plane : in.planes) {
        plane.normal = T.R * plane.normal;
        plane.offset -= dot(plane.normal, T.t);
        for (auto& ring : plane.rings)
            for (Vec3d& p : ring) p = T * p;
    }
    in.objects.clear();
    auto plan = make_floor_plan(in);
    ASSERT_TRUE(plan.ok());
    EXPECT_NEAR(plan->T_plan_world.R.determinant(), 1, 1e-12);
    ASSERT_EQ(plan->walls.size(), 4u);
    for (const PlanSegment& wall : plan->walls) {
        EXPECT_NEAR(std::min(std::fabs(wall.to.x - wall.from.x), std::fabs(wall.to.y - wall.from.y)), 0,
                    1e-9);
        EXPECT_NEAR(wall.foot, 0, 1e-9);
    }
    EXPECT_NEAR(length_of(plan->walls[0]), 4, 1e-9);
    ASSERT_EQ(plan->furniture.size(), 2u);  // the seat stands for its chair now
}

// A wall with two pieces and a hole in one of them.
TEST(FloorPlan, AWallInPieces) {
    FloorPlanInput in;
    FloorPlanPlane wall = upright(3, kWall, {0, 0, 0}, {2, 0, 0}, 0, 2.5);
    wall.rings.push_back(upright(3, kWall, {0.5, 0, 0}, {1, 0, 0}, 1, 2).rings[0]);
    wall.rings.push_back(upright(3, kWall, {3, 0, 0}, {5, 0, 0}, 0.2, 2.2).rings[0]);
    wall.rings.push_back(upright(3, kWall, {6, 0, 0}, {6.05, 0, 0}, 0.2, 2.2).rings[0]);
    in.planes.push_back(wall);
    auto plan = make_floor_plan(in);
    ASSERT_TRUE(plan.ok());
    ASSERT_EQ(plan->walls.size(), 2u);
    EXPECT_NEAR(length_of(plan->walls[0]), 2, 1e-9);
    EXPECT_NEAR(plan->walls[0].height, 2.5, 1e-9);
    EXPECT_NEAR(length_of(plan->walls[1]), 2, 1e-9);
    EXPECT_NEAR(plan->walls[1].height, 2, 1e-9);
}

TEST(FloorPlan, FilesAreWholeAndReadBack) {
    const Folder folder;
    ASSERT_TRUE(write_floor_plan(folder / "floorplan.svg", folder / "floorplan.json", room()).ok());
    const auto json = nlohmann::json::parse(slurp(folder / "floorplan.json"));
    EXPECT_EQ(json["walls"].size(), 4u);
    EXPECT_EQ(json["walls"][1]["id"], 1);
    EXPECT_EQ(json["walls"][1]["to"], (nlohmann::json{4.0, 0.0}));
    EXPECT_EQ(json["walls"][1]["height"], 2.5);
    EXPECT_EQ(json["doors"].size(), 1u);
    EXPECT_EQ(json["windows"].size(), 1u);
    EXPECT_EQ(json["free_space"].size(), 2u);
    EXPECT_EQ(json["furniture"][1]["label"], "table");
    EXPECT_EQ(json["up"], (nlohmann::json{0.0, 0.0, 1.0}));
    EXPECT_EQ(json["T_plan_world"][2][3], -0.5);
    const std::string svg = slurp(folder / "floorplan.svg");
    EXPECT_NE(svg.find("viewBox=\"-0.700 -3.700 5.400 4.400\""), std::string::npos) << svg.substr(0, 300);
    EXPECT_EQ(svg.substr(svg.size() - 7), "</svg>\n");
    EXPECT_EQ(svg.find("nan"), std::string::npos);
    EXPECT_EQ(folder.files(), 2u);

    // Nothing at all is a plan too.
    EXPECT_TRUE(write_floor_plan(folder / "empty.svg", folder / "empty.json", {}).ok());
    EXPECT_EQ(nlohmann::json::parse(slurp(folder / "empty.json"))["walls"].size(), 0u);
}

TEST(FloorPlan, RefusesWhatIsNotFinite) {
    const Folder folder;
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();
    spill(folder / "p.svg", "old");
    const auto refused = [&](const FloorPlanInput& in, const char* what) {
        const Status status = write_floor_plan(folder / "p.svg", folder / "p.json", in);
        EXPECT_EQ(status.code(), Code::invalid_argument);
        const std::string text = status.text();
        EXPECT_NE(text.find(what), std::string::npos) << text;
        EXPECT_EQ(text.find('\n'), std::string::npos);
        EXPECT_EQ(slurp(folder / "p.svg"), "old");
        EXPECT_EQ(folder.files(), 1u);
    };
    FloorPlanInput in = room();
    in.planes[2].rings[0][1].y = nan;
    refused(in, "plane 2");
    in = room();
    in.planes[5].offset = inf;
    refused(in, "plane 5");
    in = room();
    in.objects[1].high.z = inf;
    refused(in, "object 1");
    in = room();
    in.up_world = {0, 0, 2};
    refused(in, "up");
    EXPECT_EQ(write_floor_plan(folder / "none/p.svg", folder / "p.json", room()).code(), Code::io);
}

}  // namespace
}  // namespace burin
