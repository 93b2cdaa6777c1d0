// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <exception>
#include <new>

#include "eval/triangle_bvh.h"

namespace burin {
namespace {

constexpr std::uint32_t kLeafSize = 4;         // below it a box test costs more than the triangles
constexpr int kBins = 16;                      // Wald 2007: more bring nothing
constexpr std::uint32_t kSerialBelow = 16384;  // a subtree of this size is one job (a few ms)
constexpr std::uint32_t kUnused = 0xffffffff;
constexpr int kMaxDepth =
    60;  // then split in the middle: 60 + 32 levels at most, which bounds the query stack

struct Box {
    Vec3f low{std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(),
              std::numeric_limits<float>::infinity()};
    Vec3f high{-std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
               -std::numeric_limits<float>::infinity()};

    void add(Vec3f lower, Vec3f upper) {
        low = {std::min(low.x, lower.x), std::min(low.y, lower.y), std::min(low.z, lower.z)};
        high = {std::max(high.x, upper.x), std::max(high.y, upper.y), std::max(high.z, upper.z)};
    }
    double half_area() const {
        const double x = double(high.x) - low.x, y = double(high.y) - low.y, z = double(high.z) - low.z;
        return x < 0 ? 0 : x * y + y * z + z * x;
    }
};

// What the build sorts: the box of a triangle. Its centre stands for it.
struct Item {
    Vec3f low, high;
    std::uint32_t index;
    // Halved before the sum, which two large floats would overflow.
    float centre(int axis) const { return 0.5f * low[axis] + 0.5f * high[axis]; }
};

}  // namespace

// A subtree over n items has at most 2n - 1 nodes, so it gets that many slots of a scratch array, its root
// first and its first child right behind: every job knows its slots beforehand. Unused slots are squeezed out
// at the end.
struct TriangleBvh::Builder {
    struct Range {
        std::uint32_t begin, end, slot;
        int depth;
    };

    std::vector<Item> items;
    std::vector<Node> slots;  // count == kUnused where there is no node

    // Chooses the split of a range and reorders its items. Returns the first item of the second half, or
    // `end` when the range is a leaf. Fills the node's box.
    std::uint32_t split(const Range& range, Node* node) {
        Box box, centres;
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            const Item& item = items[i];
            const Vec3f centre = {item.centre(0), item.centre(1), item.centre(2)};
            box.add(item.low, item.high);
            centres.add(centre, centre);
        }
        node->low = box.low;
        node->high = box.high;
        const std::uint32_t count = range.end - range.begin;
        if (count <= kLeafSize) return range.end;

        int axis = 0;
        for (int i = 1; i < 3; ++i)
            if (centres.high[i] - centres.low[i] > centres.high[axis] - centres.low[axis]) axis = i;
        const std::uint32_t middle = range.begin + count / 2;
        const float extent = centres.high[axis] - centres.low[axis];
        // All centres in one place (or so close that dividing by their extent overflows): any half is as
        // good.
        const float scale = kBins / extent;
        if (!(extent > 0) || !std::isfinite(scale) || !std::isfinite(extent)) return middle;
        if (range.depth >= kMaxDepth) return middle;

        const auto bin_of = [&](const Item& item) {
            return std::min(static_cast<int>((item.centre(axis) - centres.low[axis]) * scale), kBins - 1);
        };
        Box bins[kBins];
        std::uint32_t counts[kBins] = {};
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            const int bin = bin_of(items[i]);
            bins[bin].add(items[i].low, items[i].high);
            ++counts[bin];
        }
        // Cost of a split behind each bin: area times count on both sides.
        double left_cost[kBins] = {};
        Box left;
        std::uint32_t left_count = 0;
        for (int b = 0; b + 1 < kBins; ++b) {
            left.add(bins[b].low, bins[b].high);
            left_count += counts[b];
            left_cost[b] = left.half_area() * left_count;
        }
        Box right;
        std::uint32_t right_count = 0;
        int best = -1;
        double best_cost = std::numeric_limits<double>::infinity();
        for (int b = kBins - 2; b >= 0; --b) {
            right.add(bins[b + 1].low, bins[b + 1].high);
            right_count += counts[b + 1];
            if (right_count == 0 || right_count == count) continue;
            const double cost = left_cost[b] + right.half_area() * right_count;
            if (cost < best_cost) {
                best_cost = cost;
                best = b;
            }
        }
        if (best < 0) return middle;
        const auto second = std::partition(items.begin() + range.begin, items.begin() + range.end,
                                           [&](const Item& item) { return bin_of(item) <= best; });
        return static_cast<std::uint32_t>(second - items.begin());
    }

    // Makes the node of a range. Returns whether it has children, then in `first` and `second`.
    bool make_node(const Range& range, Range* first, Range* second) {
        Node& node = slots[range.slot];
        const std::uint32_t middle = split(range, &node);
        if (middle == range.end) {
            node.first = range.begin;
            node.count = range.end - range.begin;
            return false;
        }
        *first = {range.begin, middle, range.slot + 1, range.depth + 1};
        *second = {middle, range.end, range.slot + 2 * (middle - range.begin), range.depth + 1};
        node.first = second->slot;
        node.count = 0;
        return true;
    }

    // Splits until every range is at most `largest`; those are appended to `rest`, or finished when it is
    // null.
    void subdivide(const Range& root, std::uint32_t largest, std::vector<Range>* rest) {
        std::vector<Range> open = {root};
        while (!open.empty()) {
            const Range range = open.back();
            open.pop_back();
            if (rest && range.end - range.begin <= largest) {
                rest->push_back(range);
                continue;
            }
            Range first, second;
            if (!make_node(range, &first, &second)) continue;
            open.push_back(second);
            open.push_back(first);
        }
    }

    // Moves the nodes together, keeping their order.
    void compact(std::vector<Node>* nodes) {
        std::vector<std::uint32_t> place(slots.size());
        std::uint32_t count = 0;
        for (std::size_t i = 0; i < slots.size(); ++i) {
            place[i] = count;
            count += slots[i].count != kUnused;
        }
        nodes->reserve(count);
        for (const Node& slot : slots) {
            if (slot.count == kUnused) continue;
            nodes->push_back(slot);
            if (slot.count == 0) nodes->back().first = place[slot.first];
        }
    }
};

Result<TriangleBvh> TriangleBvh::build(const TriangleMesh& mesh, Jobs& jobs) try {
    constexpr std::size_t kMaxTriangles = 0x7fffffff;  // slots are counted in 32 bits
    const std::size_t count = mesh.triangles.size();
    if (count == 0)
        return Status::error(Code::invalid_argument, "the mesh has no triangles, expected a surface");
    if (count > kMaxTriangles)
        return Status::error(Code::unsupported, "the mesh has %zu triangles, expected at most %zu", count,
                             kMaxTriangles);
    Builder builder;
    builder.items.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        Box box;
        for (const std::uint32_t v : mesh.triangles[i]) {
            if (v >= mesh.positions.size())
                return Status::error(Code::invalid_argument,
                                     "mesh triangle %zu uses vertex %u, expected below %zu", i, v,
                                     mesh.positions.size());
            const Vec3f p = mesh.positions[v];
            if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
                return Status::error(Code::invalid_argument,
                                     "mesh vertex %u is (%g, %g, %g), expected finite numbers", v, p.x, p.y,
                                     p.z);
            box.add(p, p);
        }
        builder.items.push_back({box.low, box.high, static_cast<std::uint32_t>(i)});
    }
    Node unused;
    unused.count = kUnused;
    builder.slots.assign(2 * count - 1, unused);
    std::vector<Builder::Range> subtrees;
    builder.subdivide({0, static_cast<std::uint32_t>(count), 0, 0}, kSerialBelow, &subtrees);
    std::vector<std::uint8_t> failed(subtrees.size(), 0);
    jobs.run(static_cast<int>(subtrees.size()), [&](int i, int) {
        try {
            builder.subdivide(subtrees[static_cast<std::size_t>(i)], 0, nullptr);
        } catch (const std::exception&) {
            failed[static_cast<std::size_t>(i)] = 1;
        }
    });
    if (std::find(failed.begin(), failed.end(), 1) != failed.end()) throw std::bad_alloc();

    TriangleBvh bvh;
    builder.compact(&bvh.nodes_);
    builder.slots = {};
    bvh.triangles_.reserve(count);
    bvh.place_of_.resize(count);
    for (const Item& item : builder.items) {
        const auto& corners = mesh.triangles[item.index];
        bvh.place_of_[item.index] = static_cast<std::uint32_t>(bvh.triangles_.size());
        bvh.triangles_.push_back(
            {mesh.positions[corners[0]], mesh.positions[corners[1]], mesh.positions[corners[2]], item.index});
    }
    return bvh;
} catch (const std::exception&) {
    return Status::error(Code::insufficient_memory, "no memory for the search tree of %zu triangles",
                         mesh.triangles.size());
}

}  // namespace burin
