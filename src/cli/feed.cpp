// SPDX-License-Identifier: MIT
#include "cli/feed.h"

#include <algorithm>
#include <filesystem>

#include "api/c_frame.h"
#include "cli/common.h"
#include "cli/record_source.h"
#include "datasets/open.h"
#include "datasets/prefetch.h"

namespace burin::cli {
namespace {

class DatasetFeed final : public FrameFeed {
  public:
    // Decoding a VGA pair takes about 8 ms on one core; a few frames ahead hide its jitter.
    DatasetFeed(std::unique_ptr<Dataset> dataset, const Camera& depth, int begin, int end, int min_confidence)
        : min_confidence_(min_confidence),
          dataset_(std::move(dataset)),
          depth_(depth),
          total_(end - begin),
          prefetcher_(*dataset_, begin, end, 4, 1) {}

    Result<bool> next(FeedFrame* out) override {
        Frame& frame = frames_[at_ ^= 1];
        const Result<bool> got = prefetcher_.next(&frame);
        if (!got.ok() || !*got) return got;
        out->view = c_frame(frame);
        if (min_confidence_ >= 0) out->view.min_confidence = static_cast<std::uint32_t>(min_confidence_);
        out->has_pose = frame.has_pose;
        out->arrived_ns = 0;
        return true;
    }
    int index() const override { return prefetcher_.index(); }
    bool looks_ahead() const override { return true; }
    int total() const override { return total_; }
    int width() const override { return depth_.width; }
    int height() const override { return depth_.height; }
    std::string notes() override { return dataset_->notes(); }

  private:
    int min_confidence_;
    std::unique_ptr<Dataset> dataset_;
    Camera depth_;
    int total_;
    FramePrefetcher prefetcher_;
    Frame frames_[2];
    int at_ = 0;
};

class SourceFeed final : public FrameFeed {
  public:
    SourceFeed(const FeedOptions& o, double end_ms) : options_(o), end_ms_(end_ms) {}
    Status open(bool quiet) {
        BURIN_TRY(source_.open(options_.path, options_.source, quiet));
        if (burin_source_stream(source_.get(), BURIN_STREAM_DEPTH, &depth_) == BURIN_OK && depth_.width > 0)
            return options_.record.empty() ? Status() : recorder_.open(source_.get(), options_.record, {});
        return Status::error(Code::unsupported, "%s delivers no depth", options_.path.c_str());
    }

    Result<bool> next(FeedFrame* out) override {
        for (;;) {
            if (index_ + 1 >= options_.end || (end_ms_ > 0 && now_ms() > end_ms_)) return false;
            burin_captured_frame captured = {};
            captured.struct_size = sizeof captured;
            const Result<bool> got = source_.next(&captured);
            if (!got.ok() || !*got) return got;
            ++index_;
            record(captured);
            if (index_ < options_.begin || !captured.images[BURIN_STREAM_DEPTH].data) continue;
            if (burin_frame_of_capture(source_.get(), &captured, &out->view) != BURIN_OK)
                return Status::error(Code::state, "%s", burin_source_error(source_.get()));
            if (options_.min_confidence >= 0)
                out->view.min_confidence = static_cast<std::uint32_t>(options_.min_confidence);
            out->has_pose = false;
            out->arrived_ns = 0;
            for (const burin_image& image : captured.images)
                if (image.data) out->arrived_ns = std::max(out->arrived_ns, image.host_ns);
            return true;
        }
    }
    int index() const override { return index_; }
    int total() const override { return options_.end < 1000000000 ? options_.end - options_.begin : 0; }
    int width() const override { return static_cast<int>(depth_.width); }
    int height() const override { return static_cast<int>(depth_.height); }
    nlohmann::json report() override {
        nlohmann::json all = source_report(source_.get());
        if (options_.record.empty()) return all;
        if (const Status finished = recorder_.finish(); !finished.ok() && !refused_)
            std::fprintf(stderr, "burin: %s\n", finished.text());
        all["recording"] = recorder_.report();
        return all;
    }

  private:
    // A disk that is full ends the recording, not the scan.
    void record(const burin_captured_frame& captured) {
        if (options_.record.empty() || refused_) return;
        const Status added = recorder_.add(captured);
        refused_ = !added.ok();
        if (refused_) std::fprintf(stderr, "burin: %s; the scan goes on\n", added.text());
    }

    FeedOptions options_;
    double end_ms_;
    OwnedSource source_;
    OwnedRecorder recorder_;
    bool refused_ = false;
    burin_stream_info depth_ = {};
    int index_ = -1;
};

}  // namespace

bool is_source_address(const std::string& path) {
    const std::size_t colon = path.find(':');
    std::error_code ignored;
    if (colon == std::string::npos || std::filesystem::exists(path, ignored)) return false;
    char name[32];
    for (std::uint32_t i = 0; i < burin_backend_count(); ++i)
        if (burin_backend(i, name, sizeof name, nullptr, 0, nullptr, 0) == BURIN_OK &&
            path.compare(0, colon, name) == 0)
            return true;
    return false;
}

Result<std::unique_ptr<FrameFeed>> open_dataset_feed(const FeedOptions& o) {
    auto dataset = open_dataset(o.path, o.format);
    if (!dataset.ok()) return dataset.status();
    const int frames = (*dataset)->frame_count(), end = std::min(o.end, frames);
    if (o.begin >= end)
        return Status::error(Code::invalid_argument, "%s: %d frames, --frames asks for those from %d on",
                             o.path.c_str(), frames, o.begin);
    // The first frame tells the size that the map has to make room for.
    Frame first;
    BURIN_TRY((*dataset)->load(o.begin, &first));
    return std::unique_ptr<FrameFeed>(std::make_unique<DatasetFeed>(std::move(*dataset), first.depth_camera,
                                                                    o.begin, end, o.min_confidence));
}

Result<std::unique_ptr<FrameFeed>> open_source_feed(const FeedOptions& o) {
    auto feed = std::make_unique<SourceFeed>(o, o.seconds > 0 ? now_ms() + o.seconds * 1000 : 0);
    BURIN_TRY(feed->open(o.quiet));
    return std::unique_ptr<FrameFeed>(std::move(feed));
}

}  // namespace burin::cli
