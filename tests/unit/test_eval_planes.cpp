// SPDX-License-Identifier: MIT
// Figures of planes where the answer is known.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "eval/plane_metrics.h"

using namespace burin;

namespace {

// A rectangle at height z, facing up.
LabelledPlane flat(int id, double x0, double y0, double x1, double y1, double z) {
    LabelledPlane plane;
    plane.id = id;
    plane.normal = {0, 0, 1};
    plane.offset = -z;
    plane.area_m2 = plane.seen_area_m2 = (x1 - x0) * (y1 - y0);
    plane.rings = {{{x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z}}};
    return plane;
}

// Turned about the y axis through (centre, *, z).
LabelledPlane tilted(LabelledPlane plane, double degrees, double centre_x) {
    const double a = degrees / 180 * std::acos(-1.0), z = -plane.offset;
    plane.normal = {std::sin(a), 0, std::cos(a)};
    plane.offset = -dot(plane.normal, {centre_x, 0, z});
    return plane;
}

}  // namespace

TEST(PlaneRaster, CountsAreaWithHoles) {
    LabelledPlane plane = flat(0, 0, 0, 2, 1, 0.5);
    plane.rings.push_back({{0.5, 0.25, 0.5}, {1, 0.25, 0.5}, {1, 0.75, 0.5}, {0.5, 0.75, 0.5}});
    const PlaneRaster cells(plane.normal, plane.offset, plane.rings, 0.01);
    EXPECT_NEAR(cells.area_m2(), 1.75, 1e-9);
    EXPECT_TRUE(cells.contains({0.25, 0.5, 0.5}));
    EXPECT_FALSE(cells.contains({0.75, 0.5, 0.5}));
    EXPECT_FALSE(cells.contains({-0.25, 0.5, 0.5}));
    for (std::size_t c = 0; c < cells.size(); c += 97) {
        EXPECT_EQ(cells.cell_at(cells.centre(c)), static_cast<std::ptrdiff_t>(c));
        EXPECT_NEAR(cells.centre(c).z, 0.5, 1e-12);
    }
    // A triangle whose sides cut cells: half its rectangle, to the width of a cell.
    const PlaneRaster half({0, 0, 1}, 0, {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}, 0.01);
    EXPECT_NEAR(half.area_m2(), 0.5, 0.01);
}

TEST(PlaneRaster, HullClosesDentsAndLeavesTheOutside) {
    // A "C" of 5 x 5 cells in a grid of 8 x 7.
    std::vector<std::uint8_t> marked(8 * 7, 0);
    for (int i = 1; i <= 5; ++i) marked[8 * 1 + i] = marked[8 * 5 + i] = 1;
    for (int j = 1; j <= 5; ++j) marked[8 * j + 1] = 1;
    const auto hull = hull_of_cells(marked, 8, 7);
    for (int j = 0; j < 7; ++j)
        for (int i = 0; i < 8; ++i)
            EXPECT_EQ(hull[8 * j + i], i >= 1 && i <= 5 && j >= 1 && j <= 5 ? 1 : 0) << i << " " << j;
    // A diagonal of three cells: itself.
    std::vector<std::uint8_t> line(16, 0);
    line[0] = line[5] = line[10] = 1;
    EXPECT_EQ(hull_of_cells(line, 4, 4), line);
    EXPECT_EQ(hull_of_cells(std::vector<std::uint8_t>(16, 0), 4, 4), std::vector<std::uint8_t>(16, 0));
}

TEST(PlaneMatch, ErrorsAreThoseThatWereMade) {
    const std::vector<LabelledPlane> truth = {flat(0, 0, 0, 2, 1, 0), flat(1, 0, 0, 1, 1, 0.7),
                                              flat(2, 3, 0, 4, 1, 0.7)};
    const std::vector<LabelledPlane> found = {tilted(flat(7, 0, 0, 1, 1, 0.703), 0.5, 0.5),
                                              flat(8, 0, 0, 2, 1, 0.001), flat(9, 3, 0, 4, 1, 0.7)};
    const PlaneMatches m = match_planes(found, truth, {});
    EXPECT_EQ(m.recall, 1);
    EXPECT_EQ(m.precision, 1);
    ASSERT_EQ(m.pairs.size(), 3u);
    EXPECT_EQ(m.pairs[0].truth, 0);
    EXPECT_EQ(m.pairs[0].found, 1);
    EXPECT_NEAR(m.pairs[0].offset_m, -0.001, 1e-9);  // the true plane lies below the found one
    EXPECT_NEAR(m.pairs[0].overlap_m2, 2, 1e-9);
    EXPECT_NEAR(m.worst_angle_deg, 0.5, 1e-9);
    EXPECT_NEAR(m.worst_offset_m, 0.003, 1e-6);
    EXPECT_NEAR(m.median_offset_m, 0.001, 1e-9);
    EXPECT_NEAR(m.median_angle_deg, 0, 1e-9);
}

TEST(PlaneMatch, SaysWhyAPlaneIsMissedOrFalse) {
    const std::vector<LabelledPlane> truth = {flat(0, 0, 0, 1, 1, 0), flat(1, 2, 0, 3, 1, 0),
                                              flat(2, 4, 0, 5, 1, 0), flat(3, 6, 0, 7, 1, 0),
                                              flat(4, 8, 0, 9, 1, 0)};
    std::vector<LabelledPlane> found = {tilted(flat(0, 0, 0, 1, 1, 0), 1.5, 0.5), flat(1, 2, 0, 3, 1, 0.006),
                                        flat(2, 4.9, 0, 5.9, 1, 0), flat(3, 6, 0, 7, 1, 0)};
    found[3].normal = -found[3].normal;
    const PlaneMatches m = match_planes(found, truth, {});
    EXPECT_EQ(m.recall, 0);
    EXPECT_EQ(m.precision, 0);
    ASSERT_EQ(m.missed.size(), 5u);
    ASSERT_EQ(m.invented.size(), 4u);
    const char* reasons[] = {"normal", "offset", "overlap", "normal", "nothing there"};
    for (std::size_t i = 0; i < 5; ++i) EXPECT_STREQ(m.missed[i].reason, reasons[i]) << i;
    for (std::size_t i = 0; i < 4; ++i) EXPECT_STREQ(m.invented[i].reason, reasons[i]) << i;
    EXPECT_NEAR(m.missed[0].best.angle_deg, 1.5, 1e-9);
    EXPECT_NEAR(m.missed[1].best.offset_m, -0.006, 1e-9);
    EXPECT_NEAR(m.missed[3].best.angle_deg, 180, 1e-9);
    EXPECT_EQ(m.missed[4].best.found, -1);
}

TEST(PlaneMatch, IsOneToOneForRecallAndCountsOnlyWhatWasSeen) {
    // One found plane over two true ones; two found ones on one; a true one hardly seen; a small found one.
    std::vector<LabelledPlane> truth = {flat(0, 0, 0, 1, 1, 0), flat(1, 1, 0, 3, 1, 0),
                                        flat(2, 5, 0, 7, 1, 0), flat(3, 8, 0, 9, 1, 0)};
    truth[3].seen_area_m2 = 0.2;
    const std::vector<LabelledPlane> found = {flat(0, 0, 0, 3, 1, 0), flat(1, 5, 0, 6, 1, 0),
                                              flat(2, 6, 0, 7, 1, 0), flat(3, 8, 0, 9, 1, 0.001),
                                              flat(4, 0, 0, 0.4, 0.4, 1)};
    const PlaneMatches m = match_planes(found, truth, {});
    EXPECT_EQ(m.true_planes, 3);
    EXPECT_NEAR(m.recall, 2.0 / 3, 1e-12);
    ASSERT_EQ(m.missed.size(), 1u);
    EXPECT_EQ(m.missed[0].plane, 0);
    EXPECT_STREQ(m.missed[0].reason, "taken");
    EXPECT_EQ(m.missed[0].best.found, 0);
    EXPECT_EQ(m.found_planes, 4);
    EXPECT_EQ(m.precision, 1);
    EXPECT_EQ(m.split, 1);
}

TEST(PlaneFile, ReadsPolygonsAndRingsAndNamesWhatIsWrong) {
    const auto planes = parse_planes(
        R"([{"id":3,"label":"floor","normal":[0,0,1],"offset":0.5,"area_m2":0.5,"polygon":[[0,0,-0.5],[1,0,-0.5],[0,1,-0.5]]},
            {"id":4,"label":"wall","normal":[0,1,0],"offset":0,"area_m2":1,"seen_area_m2":0.25,"polygon":[],
             "rings":[[[0,0,0],[1,0,0],[1,0,1]],[[2,0,0],[3,0,0],[3,0,1]]],"covariance":[],"support":12}])",
        "test");
    ASSERT_TRUE(planes.ok()) << planes.status().text();
    ASSERT_EQ(planes->size(), 2u);
    EXPECT_EQ((*planes)[0].id, 3);
    EXPECT_EQ((*planes)[0].label, 2);
    EXPECT_EQ((*planes)[0].offset, 0.5);
    ASSERT_EQ((*planes)[0].rings.size(), 1u);
    EXPECT_EQ((*planes)[0].rings[0].size(), 3u);
    EXPECT_EQ((*planes)[1].rings.size(), 2u);
    EXPECT_EQ((*planes)[1].seen_area_m2, 0.25);
    const struct {
        const char *text, *says;
    } faults[] = {
        {"{}", "list of planes"},
        {R"([{"id":0,"label":"lawn"}])", "\"label\""},
        {R"([{"id":0,"label":"wall","normal":[0,0,2]}])", "unit length"},
        {R"([{"id":0,"label":"wall","normal":[0,0,1],"offset":null}])", "\"offset\""},
        {R"([{"id":0,"label":1,"normal":[0,0,1],"offset":0,"area_m2":1,"polygon":[[0,0]]}])", "\"polygon\""}};
    for (const auto& fault : faults) {
        const auto read = parse_planes(fault.text, "test");
        ASSERT_FALSE(read.ok()) << fault.text;
        EXPECT_NE(std::strstr(read.status().text(), fault.says), nullptr) << read.status().text();
    }
}
