// SPDX-License-Identifier: MIT
// Points that hold a motion that few others hold stay, others are thinned.
#include "track/point_selection.h"

#include "track_helpers.h"

namespace burin {
namespace {

struct Tracked : TrackRig {
    explicit Tracked(int threads = 1) : TrackRig(depth_options(), threads) {
        lay_out(test_camera(), 5, [&](Arena& arena) {
            grey.place(arena);
            brightness.place(arena);
            selection.place(arena);
        });
    }
    static DepthOptions depth_options() {
        DepthOptions o = noiseless_depth();
        o.edge_removal = false;
        return o;
    }
    void see(const Image<float>& image) { build_points(image, test_camera()); }

    GreyImage grey;
    PointBrightness brightness;
    PointSelection selection;
};

// Of a box that stands before the wall with an edge towards the camera: the only thing that holds it
// sideways.
bool in_box(int column, int row) { return std::abs(column - 80) < 14 && std::abs(row - 60) < 14; }

Image<float> wall_and_box() {
    const Camera camera = test_camera();
    Image<float> depth(160, 120, 1, 2.0f);
    for (int y = 0; y < 120; ++y)
        for (int x = 0; x < 160; ++x)
            if (in_box(x, y))  // z = 1.5 + |x|
                depth.view().at(x, y) =
                    static_cast<float>(1.5 / (1 - std::fabs((x - camera.cx) / camera.fx)));
    return depth;
}

// Points of the finest list inside the rectangle |column - 80| < w, |row - 60| < h.
int count_within(const TrackLevel& level, int w, int h) {
    int count = 0;
    for (int k = 0; k < level.count; ++k)
        count +=
            std::abs(level.cell[k] % level.width - 80) < w && std::abs(level.cell[k] / level.width - 60) < h;
    return count;
}

TEST(PointSelection, KeepsTheBoxAndThinsTheWall) {
    Tracked t;
    t.see(wall_and_box());
    const int all = t.points.level(0).count, coarser = t.points.level(1).count;
    const int box = count_within(t.points.level(0), 12, 12), middle = count_within(t.points.level(0), 40, 30);
    EXPECT_GT(box, 500);
    t.selection.select(t.points, nullptr, t.jobs);
    const TrackLevel& level = t.points.level(0);
    const int box_kept = count_within(level, 12, 12), middle_kept = count_within(level, 40, 30);
    // Measured 8201 of 19200 points, of the box 529 of 529, around it 1128 of 4132.
    EXPECT_GT(box_kept, 0.95 * box);
    EXPECT_LT(middle_kept - box_kept, 0.4 * (middle - box));
    EXPECT_GT(middle_kept - box_kept, 0.2 * (middle - box));
    EXPECT_GT(level.count, 0.35 * all);
    EXPECT_LT(level.count, 0.55 * all);
    EXPECT_EQ(t.points.level(1).count, coarser) << "only the finest";
    for (int k = 0; k < level.count; ++k) {  // the list still is of the grid, in its order
        const int cell = level.cell[k];
        ASSERT_TRUE(k == 0 || cell > level.cell[k - 1]);
        ASSERT_EQ(level.x[k], level.grid_x[cell]);
        ASSERT_EQ(level.y[k], level.grid_y[cell]);
        ASSERT_EQ(level.z[k], level.grid_z[cell]);
        ASSERT_NE(level.z[k], 0);
        ASSERT_GT(level.inverse_sigma[k], 0);
    }
}

TEST(PointSelection, KeepsWhereThereIsSomethingToSee) {
    Image<float> wall(160, 120, 1, 2.0f);
    Image<std::uint8_t> image(160, 120, 3, 100);
    for (int y = 52; y < 68; ++y)
        for (int x = 72; x < 88; ++x)
            for (int c = 0; c < 3; ++c)
                image.view().at(x, y, c) = static_cast<std::uint8_t>(60 + 20 * ((x / 2 + y) % 8));
    FrameView frame = frame_of(wall, test_camera(), {});
    frame.colour = image.view();
    frame.colour_camera = test_camera();
    int kept[2];
    for (const bool colour : {false, true}) {
        Tracked t;
        t.see(wall);
        ASSERT_TRUE(t.grey.build(frame, t.jobs));
        t.brightness.build(t.points, t.grey, frame, t.jobs);
        t.selection.select(t.points, colour ? &t.brightness : nullptr, t.jobs);
        kept[colour] = count_within(t.points.level(0), 7, 7);
    }
    EXPECT_LT(kept[0], 0.35 * 13 * 13);
    EXPECT_GT(kept[1], 0.9 * 13 * 13) << "the only thing with a gradient";
}

TEST(PointSelection, TheSameForAnyNumberOfThreads) {
    Tracked one(1), three(3);
    for (Tracked* t : {&one, &three}) {
        t->see(room_sequence().depths[5]);
        const FrameView frame = room_sequence().frame(5);
        ASSERT_TRUE(t->grey.build(frame, t->jobs));
        t->brightness.build(t->points, t->grey, frame, t->jobs);
        t->selection.select(t->points, &t->brightness, t->jobs);
    }
    const TrackLevel &a = one.points.level(0), &b = three.points.level(0);
    ASSERT_EQ(a.count, b.count);
    EXPECT_GT(a.count, 4000);
    EXPECT_LT(a.count, 14000);
    EXPECT_EQ(std::memcmp(a.cell, b.cell, sizeof(int) * static_cast<std::size_t>(a.count)), 0);
    EXPECT_EQ(std::memcmp(a.z, b.z, sizeof(float) * static_cast<std::size_t>(a.count)), 0);
}

TEST(PointSelection, NothingToChooseFrom) {
    Tracked t;
    t.see(Image<float>(160, 120));
    t.selection.select(t.points, nullptr, t.jobs);
    EXPECT_EQ(t.points.level(0).count, 0);
    // One reading; and a patch of sixteen, less than a cell with a normal has around it.
    for (const int side : {1, 4}) {
        Image<float> few(160, 120);
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) few.view().at(80 + x, 60 + y) = 2;
        t.see(few);
        t.selection.select(t.points, nullptr, t.jobs);
        EXPECT_LE(t.points.level(0).count, side * side);
        EXPECT_GT(t.points.level(0).count, 0);
    }
}

}  // namespace
}  // namespace burin
