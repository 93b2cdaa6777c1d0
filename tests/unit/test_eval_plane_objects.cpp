// SPDX-License-Identifier: MIT
// Objects by their boxes, and the true ones of a table with five solids on it.
#include <gtest/gtest.h>

#include <cstring>

#include "eval/plane_objects.h"
#include "scene_helpers.h"

using namespace burin;
using synthetic::Part;
using synthetic::SceneData;

namespace {

ObjectBounds bounds(int id, Vec3d low, Vec3d high) { return {id, low, high, ""}; }

void add_box(SceneData* data, int instance, int label, Vec3d low, Vec3d high) {
    Part part;
    part.label = static_cast<std::uint8_t>(label);
    part.instance = static_cast<std::uint16_t>(instance);
    part.position = (low + high) * 0.5;
    part.size = (high - low) * 0.5;
    data->parts.push_back(part);
}

}  // namespace

TEST(PlaneObjects, OverlapOfBoxes) {
    const ObjectBounds a = bounds(0, {0, 0, 0}, {2, 1, 1});
    EXPECT_EQ(box_iou(a, a), 1);
    EXPECT_NEAR(box_iou(a, bounds(1, {1, 0, 0}, {3, 1, 1})), 1.0 / 3, 1e-12);
    EXPECT_EQ(box_iou(a, bounds(1, {2, 0, 0}, {3, 1, 1})), 0);
    EXPECT_EQ(box_iou(bounds(0, {}, {}), bounds(1, {}, {})), 0);  // no volume, no overlap
}

TEST(PlaneObjects, EachIsMatchedOnce) {
    // The first is found, and found again in half; the second is found as a third of itself; the third is not
    // there.
    const std::vector<ObjectBounds> truth = {bounds(0, {0, 0, 0}, {2, 1, 1}), bounds(1, {5, 0, 0}, {8, 1, 1}),
                                             bounds(2, {9, 0, 0}, {10, 1, 1})};
    const std::vector<ObjectBounds> found = {
        bounds(0, {0, 0, 0}, {1.2, 1, 1}), bounds(1, {0, 0, 0}, {2, 1, 1}), bounds(2, {5, 0, 0}, {6, 1, 1})};
    const ObjectMatches m = match_objects(found, truth, 0.5);
    EXPECT_NEAR(m.recall, 1.0 / 3, 1e-12);
    EXPECT_NEAR(m.precision, 1.0 / 3, 1e-12);
    ASSERT_EQ(m.pairs.size(), 1u);
    EXPECT_EQ(m.pairs[0].found, 1);
    ASSERT_EQ(m.missed.size(), 2u);
    EXPECT_EQ(m.missed[0].found, 2);
    EXPECT_NEAR(m.missed[0].iou, 1.0 / 3, 1e-12);
    EXPECT_EQ(m.missed[1].truth, 2);
    EXPECT_EQ(m.missed[1].found, -1);
    ASSERT_EQ(m.invented.size(), 2u);
    EXPECT_EQ(m.invented[0].found, 0);
    EXPECT_NEAR(m.invented[0].iou, 0.6, 1e-12);  // enough, but taken
    EXPECT_EQ(match_objects({}, truth, 0.5).recall, 0);
    EXPECT_EQ(match_objects({}, truth, 0.5).precision, 1);
}

TEST(PlaneObjects, TrueObjectsAreWhatTouchesAndWasSeen) {
    SceneData data;
    add_box(&data, 1, 4, {-1, -1, -0.1}, {1, 1, 0});              // the table
    add_box(&data, 2, 0, {-0.5, 0, -0.001}, {-0.4, 0.1, 0.1});    // two that touch
    add_box(&data, 3, 0, {-0.4, 0, -0.001}, {-0.3, 0.1, 0.05});   //
    add_box(&data, 3, 5, {0.3, 0, -0.001}, {0.4, 0.1, 0.1});      // one apart, though of the same object
    add_box(&data, 4, 0, {0, 0.2, -0.001}, {0.02, 0.22, 0.02});   // small
    add_box(&data, 5, 0, {0, -0.3, -0.001}, {0.3, -0.1, 0.004});  // a sheet
    add_box(&data, 6, 0, {0, 0, -0.8}, {0.1, 0.1, -0.7});         // under the table
    data.bounds = {{-3, -3, -3}, {3, 3, 3}};
    data.mesh_bounds = {{-1, -1, -1}, {1, 1, 1}};
    const auto scene = SyntheticScene::create(std::move(data));
    ASSERT_TRUE(scene.ok()) << scene.status().text();
    Trajectory poses(2);
    poses[0].T_world_camera = look_from({-0.8, -0.8, 0.9}, {0, 0, 0}, {0, 0, 1});
    poses[1].T_world_camera = look_from({0.8, 0.8, 0.9}, {0, 0, 0}, {0, 0, 1});
    Jobs jobs(2);
    const auto objects = true_objects(**scene, test_camera(640, 480), poses, {}, jobs);
    ASSERT_TRUE(objects.ok()) << objects.status().text();
    ASSERT_EQ(objects->size(), 2u);
    const ObjectBounds expected[] = {bounds(0, {-0.5, 0, 0}, {-0.3, 0.1, 0.1}),
                                     bounds(1, {0.3, 0, 0}, {0.4, 0.1, 0.1})};
    for (std::size_t i = 0; i < 2; ++i) {
        for (int k = 0; k < 3; ++k) {  // a pixel is 5 mm wide at 1.3 m
            EXPECT_NEAR((*objects)[i].low[k], expected[i].low[k], 0.01) << i << " " << k;
            EXPECT_NEAR((*objects)[i].high[k], expected[i].high[k], 0.01) << i << " " << k;
        }
    }
    EXPECT_EQ((*objects)[0].name, "2+3");
    EXPECT_EQ((*objects)[1].name, "3");
    // Farther than the map reaches: nothing.
    TrueObjectOptions near;
    near.max_depth_m = 0.5;
    const auto none = true_objects(**scene, test_camera(640, 480), poses, near, jobs);
    ASSERT_TRUE(none.ok());
    EXPECT_TRUE(none->empty());
}

TEST(PlaneObjects, ReadsTheListAndNamesWhatIsWrong) {
    const auto read = parse_objects(R"([{"id":4,"min":[0,1,2],"max":[3,4,5.5],"faces":12}])", "test");
    ASSERT_TRUE(read.ok()) << read.status().text();
    ASSERT_EQ(read->size(), 1u);
    EXPECT_EQ((*read)[0].id, 4);
    EXPECT_EQ((*read)[0].high, (Vec3d{3, 4, 5.5}));
    for (const char* text :
         {"3", R"([{"id":4,"min":[0,1],"max":[3,4,5]}])", R"([{"min":[0,1,2],"max":[3,4,5]}])"}) {
        const auto wrong = parse_objects(text, "test");
        ASSERT_FALSE(wrong.ok()) << text;
        EXPECT_NE(std::strstr(wrong.status().text(), "test: "), nullptr);
    }
}
