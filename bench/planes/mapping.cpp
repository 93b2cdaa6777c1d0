// SPDX-License-Identifier: MIT
#include "planes/mapping.h"

#include <algorithm>
#include <cstdlib>

#include "datasets/open.h"
#include "support/frames.h"

namespace burin::bench {

void Mapping::Freed::operator()(void* memory) const { std::free(memory); }

Mapping::Mapping(const MappingOptions& options) : options_(options) {
    FusionOptions fusion = options_of(options.config);
    fusion.planes.merge_by = options.merge_by;
    std::uint64_t bytes = 0;
    fusion.volume.capacity = FusionSession::capacity_for(fusion, &bytes);
    memory_.reset(std::aligned_alloc(4096, (bytes + 4095) & ~std::uint64_t{4095}));
    Arena arena(memory_.get(), bytes);
    session_ = std::make_unique<FusionSession>();
    session_->place(arena, fusion);
    session_->clear();
}

Status Mapping::run(const std::string& folder, const std::function<void(int)>& each) {
    const auto dataset = open_dataset(folder, "");
    if (!dataset.ok()) return dataset.status();
    Frame frame;
    for (int i = options_.first; i < std::min(options_.last, (*dataset)->frame_count()); ++i) {
        BURIN_TRY((*dataset)->load(i, &frame));
        if (!frame.has_pose) continue;
        FrameView view = view_of(frame);
        view.colour = {};
        frames_.push_back(session_->integrate(view, jobs_));
        if (frames_.back().chunks.dropped > 0)
            return Status::error(Code::insufficient_memory, "%s: frame %d: the map is full", folder.c_str(),
                                 i);
        if (each) each(static_cast<int>(frames_.size()));
    }
    if (frames_.empty())
        return Status::error(Code::invalid_argument, "%s: no frame has a pose", folder.c_str());
    return {};
}

int Mapping::told() const {
    const PlaneLayer& layer = session_->planes();
    int count = 0;
    for (std::uint32_t i = 0; i < layer.set().used(); ++i) count += layer.told(layer.set().at(i));
    return count;
}

std::vector<LabelledPlane> Mapping::planes() {
    std::vector<LabelledPlane> planes;
    PlaneLayer& layer = session_->planes();
    for (std::uint32_t i = 0; i < layer.set().used(); ++i) {
        const GlobalPlane& p = layer.set().at(i);
        if (!layer.told(p)) continue;
        LabelledPlane out;
        out.id = static_cast<int>(p.id);
        out.label = p.label;
        out.normal = p.normal;
        out.offset = p.offset;
        out.area_m2 = p.seen_area_m2 > 0 ? p.seen_area_m2 : p.area_m2;
        ExtentGrid grid;
        OutlineCounts counts;
        const Outline outline = layer.outline(static_cast<std::uint16_t>(i), false, &grid, &counts);
        for (std::uint64_t r = 0; r < counts.rings; ++r) {
            const std::uint64_t end = r + 1 < counts.rings ? outline.rings[r + 1].first : counts.points;
            out.rings.emplace_back();
            for (std::uint64_t k = outline.rings[r].first; k < end; ++k)
                out.rings.back().push_back(grid.point(outline.points[k].u, outline.points[k].v));
        }
        planes.push_back(std::move(out));
    }
    return planes;
}

double quantile(std::vector<double> values, double q) {
    if (values.empty()) return 0;
    const auto at = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1) + 0.5);
    std::nth_element(values.begin(), values.begin() + at, values.end());
    return values[static_cast<std::size_t>(at)];
}

double mean_of(const std::vector<double>& values) {
    double sum = 0;
    for (const double v : values) sum += v;
    return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

}  // namespace burin::bench
