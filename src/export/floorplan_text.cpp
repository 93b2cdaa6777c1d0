// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/triangle_mesh.h"
#include "export/floorplan.h"

namespace burin {
namespace {

// Metres on the plan.
constexpr double kMargin = 0.7;      // around everything, for the scale bar and for doors that open outwards
constexpr double kWallWidth = 0.09;  // drawn; a plane has no thickness
constexpr double kPixelsPerMetre = 90, kMostPixels = 1600;

void put(std::string* out, const char* format, ...) __attribute__((format(printf, 2, 3)));
void put(std::string* out, const char* format, ...) {
    char text[400];  // one element, numbers of %.3f below 1e30
    va_list arguments;
    va_start(arguments, format);
    const int length = std::vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    out->append(text, static_cast<std::size_t>(std::clamp(length, 0, static_cast<int>(sizeof text) - 1)));
}

// SVG's y points down.
void put_path(std::string* out, const std::vector<std::vector<PlanPoint>>& rings) {
    out->append("<path d=\"");
    for (const auto& ring : rings) {
        for (std::size_t i = 0; i < ring.size(); ++i)
            put(out, "%c%.3f %.3f", i == 0 ? 'M' : 'L', ring[i].x, -ring[i].y);
        out->append("Z");
    }
    out->append("\"/>\n");
}

void put_lines(std::string* out, const std::vector<PlanSegment>& list) {
    for (const PlanSegment& s : list)
        put(out, "<line x1=\"%.3f\" y1=\"%.3f\" x2=\"%.3f\" y2=\"%.3f\"/>\n", s.from.x, -s.from.y, s.to.x,
            -s.to.y);
}

struct Bounds {
    PlanPoint low{1e300, 1e300}, high{-1e300, -1e300};
    void add(PlanPoint p) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
};

Bounds bounds_of(const FloorPlan& plan) {
    Bounds b;
    for (const auto* list : {&plan.walls, &plan.doors, &plan.windows})
        for (const PlanSegment& s : *list) {
            b.add(s.from);
            b.add(s.to);
        }
    for (const auto& rings : plan.free_space)
        for (const auto& ring : rings)
            for (const PlanPoint& p : ring) b.add(p);
    for (const PlanOutline& outline : plan.furniture)
        for (const PlanPoint& p : outline.ring) b.add(p);
    if (b.low.x > b.high.x) b = {{-0.5, -0.5}, {0.5, 0.5}};  // nothing at all: a metre of paper
    b.low = {b.low.x - kMargin, b.low.y - kMargin};
    b.high = {b.high.x + kMargin, b.high.y + kMargin};
    return b;
}

void put_grid(std::string* out, const Bounds& b) {
    out->append("<g stroke=\"#cdd3da\" stroke-width=\"0.01\">\n");
    // A line a metre, at most some 2000 of them should the plan be that large.
    const double step = std::max(1.0, std::ceil((b.high.x - b.low.x + b.high.y - b.low.y) / 2000));
    for (double x = std::ceil(b.low.x / step) * step; x <= b.high.x; x += step)
        put(out, "<line x1=\"%.3f\" y1=\"%.3f\" x2=\"%.3f\" y2=\"%.3f\"/>\n", x, -b.low.y, x, -b.high.y);
    for (double y = std::ceil(b.low.y / step) * step; y <= b.high.y; y += step)
        put(out, "<line x1=\"%.3f\" y1=\"%.3f\" x2=\"%.3f\" y2=\"%.3f\"/>\n", b.low.x, -y, b.high.x, -y);
    out->append("</g>\n");
}

// The leaf stands open into the room, hinged where it begins; how it truly opens a scan does not tell.
void put_door(std::string* out, const PlanSegment& s) {
    const double dx = s.to.x - s.from.x, dy = s.to.y - s.from.y, r = std::hypot(dx, dy);
    const PlanPoint open{s.from.x + dy, s.from.y - dx};  // free space is on the right of from -> to
    put(out, "<line x1=\"%.3f\" y1=\"%.3f\" x2=\"%.3f\" y2=\"%.3f\"/>\n", s.from.x, -s.from.y, open.x,
        -open.y);
    put(out, "<path d=\"M%.3f %.3fA%.3f %.3f 0 0 0 %.3f %.3f\" stroke-dasharray=\"0.06 0.04\"/>\n", open.x,
        -open.y, r, r, s.to.x, -s.to.y);
}

void put_scale_bar(std::string* out, const Bounds& b) {
    const double length = b.high.x - b.low.x > 12 ? 5 : 1;
    const double x = b.low.x + 0.25, y = -b.low.y - 0.22;
    put(out,
        "<g stroke=\"#222\" stroke-width=\"0.02\"><path fill=\"none\" d=\"M%.3f %.3fv0.1h%.3fv-0.1\"/></g>\n",
        x, y - 0.05, length);
    // Letters in hundredths of a metre: some viewers round small font sizes away.
    put(out,
        "<text transform=\"translate(%.3f %.3f) scale(0.01)\" font-family=\"sans-serif\" font-size=\"16\" "
        "fill=\"#222\">%.0f m</text>\n",
        x + length + 0.08, y + 0.06, length);
}

nlohmann::ordered_json point(PlanPoint p) {
    const auto tidy = [](double v) { return std::round(v * 1e4) / 1e4 + 0.0; };  // 0.1 mm, and no -0
    return nlohmann::ordered_json::array({tidy(p.x), tidy(p.y)});
}

nlohmann::ordered_json ring_json(const std::vector<PlanPoint>& ring) {
    nlohmann::ordered_json out = nlohmann::ordered_json::array();
    for (const PlanPoint& p : ring) out.push_back(point(p));
    return out;
}

nlohmann::ordered_json segments(const std::vector<PlanSegment>& list) {
    nlohmann::ordered_json out = nlohmann::ordered_json::array();
    for (const PlanSegment& s : list) {
        const PlanPoint heights{s.foot, s.height};
        out.push_back({{"id", s.id},
                       {"from", point(s.from)},
                       {"to", point(s.to)},
                       {"foot", point(heights)[0]},
                       {"height", point(heights)[1]}});
    }
    return out;
}

}  // namespace

std::string floor_plan_svg(const FloorPlan& plan) {
    const Bounds b = bounds_of(plan);
    const double width = b.high.x - b.low.x, height = b.high.y - b.low.y;
    const double scale = std::min(kPixelsPerMetre, kMostPixels / std::max(width, height));
    std::string out = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
    put(&out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" version=\"1.1\" width=\"%.0f\" height=\"%.0f\" "
        "viewBox=\"%.3f %.3f %.3f %.3f\">\n",
        width * scale, height * scale, b.low.x, -b.high.y, width, height);
    put(&out, "<rect x=\"%.3f\" y=\"%.3f\" width=\"%.3f\" height=\"%.3f\" fill=\"#fff\"/>\n", b.low.x,
        -b.high.y, width, height);
    out += "<g id=\"free_space\" fill=\"#f3ecdf\" fill-rule=\"evenodd\">\n";
    for (const auto& rings : plan.free_space) put_path(&out, rings);
    out += "</g>\n";
    put_grid(&out, b);
    out +=
        "<g id=\"furniture\" fill=\"#c9cdd2\" stroke=\"#7d848c\" stroke-width=\"0.02\" "
        "stroke-linejoin=\"round\">\n";
    for (const PlanOutline& outline : plan.furniture) put_path(&out, {outline.ring});
    put(&out, "</g>\n<g id=\"walls\" stroke=\"#000\" stroke-width=\"%.3f\" stroke-linecap=\"square\">\n",
        kWallWidth);
    put_lines(&out, plan.walls);
    // Openings cut the wall; a pane is a line in the middle, a door's leaf is drawn open.
    for (const auto* list : {&plan.doors, &plan.windows}) {
        put(&out, "</g>\n<g stroke=\"#fff\" stroke-width=\"%.3f\">\n", kWallWidth + 0.01);
        put_lines(&out, *list);
    }
    put(&out, "</g>\n<g stroke=\"#000\" stroke-width=\"%.3f\">\n", kWallWidth);
    put_lines(&out, plan.windows);
    put(&out, "</g>\n<g stroke=\"#fff\" stroke-width=\"%.3f\">\n", kWallWidth - 0.03);
    put_lines(&out, plan.windows);
    out += "</g>\n<g id=\"windows\" stroke=\"#2f7fd0\" stroke-width=\"0.02\">\n";
    put_lines(&out, plan.windows);
    out += "</g>\n<g id=\"doors\" fill=\"none\" stroke=\"#000\" stroke-width=\"0.02\">\n";
    for (const PlanSegment& s : plan.doors) put_door(&out, s);
    out += "</g>\n";
    put_scale_bar(&out, b);
    return out + "</svg>\n";
}

std::string floor_plan_json(const FloorPlan& plan) {
    const Se3& T = plan.T_plan_world;
    nlohmann::ordered_json matrix = nlohmann::ordered_json::array();
    for (int r = 0; r < 3; ++r)
        matrix.push_back(nlohmann::ordered_json::array({T.R(r, 0), T.R(r, 1), T.R(r, 2), T.t[r]}));
    matrix.push_back(nlohmann::ordered_json::array({0, 0, 0, 1}));
    nlohmann::ordered_json free_space = nlohmann::ordered_json::array();
    for (const auto& rings : plan.free_space)
        for (const auto& ring : rings) free_space.push_back(ring_json(ring));
    nlohmann::ordered_json furniture = nlohmann::ordered_json::array();
    for (const PlanOutline& outline : plan.furniture)
        furniture.push_back({{"label", outline.label == 0 ? "object" : label_name(outline.label)},
                             {"outline", ring_json(outline.ring)}});
    nlohmann::ordered_json json = {{"up", {T.R(2, 0), T.R(2, 1), T.R(2, 2)}},
                                   {"T_plan_world", matrix},
                                   {"walls", segments(plan.walls)},
                                   {"doors", segments(plan.doors)},
                                   {"windows", segments(plan.windows)},
                                   {"free_space", free_space},
                                   {"furniture", furniture}};
    return json.dump(1) + "\n";
}

}  // namespace burin
