// SPDX-License-Identifier: MIT
#include "datasets/video.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <mutex>
#include <vector>

#include "core/camera.h"

namespace burin {
namespace {

// As many as threads may ask out of order: the prefetcher decodes at most 64 ahead, by default 4.
constexpr std::size_t kKept = 8;

std::string words_of(int error) {
    char text[AV_ERROR_MAX_STRING_SIZE] = "";
    av_strerror(error, text, sizeof text);
    return text;
}

class FfmpegVideo final : public Video {
  public:
    ~FfmpegVideo() override {
        sws_freeContext(scaler_);
        av_frame_free(&frame_);
        av_packet_free(&packet_);
        avcodec_free_context(&codec_);
        avformat_close_input(&input_);
    }

    Status open(const std::string& path);
    int frame_count() const override { return static_cast<int>(stamps_.size()); }
    int width() const override { return codec_->width; }
    int height() const override { return codec_->height; }
    Status load(int index, Image<std::uint8_t>* out) override;

  private:
    struct Key {
        std::int64_t shown, decoded;  // stamps
    };
    struct Kept {
        int index = -1;
        Image<std::uint8_t> image;
    };
    Status fail(const char* doing, int error) const {
        return Status::error(Code::format, "%s: %s: %s", path_.c_str(), doing, words_of(error).c_str());
    }
    Status list_stamps();
    Status open_codec();
    Status seek(int index);
    Result<bool> decode_next();  // the next picture into the kept ones, next_ past it; false at the end
    Status reach(int index);
    Status keep();
    const Kept* kept(int index) const;  // null: not among them

    std::string path_;
    AVFormatContext* input_ = nullptr;
    AVCodecContext* codec_ = nullptr;
    AVPacket* packet_ = nullptr;
    AVFrame* frame_ = nullptr;
    SwsContext* scaler_ = nullptr;
    int stream_ = -1;
    std::vector<std::int64_t> stamps_;  // of display, rising
    std::vector<Key> keys_;             // likewise
    std::mutex mutex_;
    std::array<Kept, kKept> kept_;
    std::size_t oldest_ = 0;
    int next_ = 0;          // what decode_next() gives, unless the file is damaged
    bool drained_ = false;  // the file has ended, the codec gives what it still holds
};

Status FfmpegVideo::open_codec() {
    const AVStream* stream = input_->streams[stream_];
    const AVCodec* decoder = avcodec_find_decoder(stream->codecpar->codec_id);
    if (!decoder)
        return Status::error(Code::unsupported, "%s: no decoder for its video (%s), expected HEVC or H.264",
                             path_.c_str(), avcodec_get_name(stream->codecpar->codec_id));
    codec_ = avcodec_alloc_context3(decoder);
    packet_ = av_packet_alloc();
    frame_ = av_frame_alloc();
    if (!codec_ || !packet_ || !frame_)
        return Status::error(Code::insufficient_memory, "%s: no memory to decode it", path_.c_str());
    int error = avcodec_parameters_to_context(codec_, stream->codecpar);
    codec_->thread_count = 1;  // frames are decoded ahead on threads of ours
    if (error >= 0) error = avcodec_open2(codec_, decoder, nullptr);
    if (error < 0) return fail("its video cannot be decoded", error);
    if (codec_->width < 1 || codec_->height < 1 || codec_->width > kMaxImageSide ||
        codec_->height > kMaxImageSide)
        return Status::error(Code::format, "%s: pictures of %dx%d, expected 1 to %d pixels a side",
                             path_.c_str(), codec_->width, codec_->height, kMaxImageSide);
    return {};
}

Status FfmpegVideo::list_stamps() {
    while (true) {
        const int error = av_read_frame(input_, packet_);
        if (error == AVERROR_EOF) break;
        if (error < 0) return fail("cannot be read to its end", error);
        if (packet_->stream_index == stream_) {
            if (packet_->pts == AV_NOPTS_VALUE)
                return Status::error(Code::format, "%s: picture %zu has no time stamp, expected one each",
                                     path_.c_str(), stamps_.size());
            stamps_.push_back(packet_->pts);
            if (packet_->flags & AV_PKT_FLAG_KEY)
                keys_.push_back({packet_->pts, packet_->dts == AV_NOPTS_VALUE ? packet_->pts : packet_->dts});
        }
        av_packet_unref(packet_);
    }
    std::sort(stamps_.begin(), stamps_.end());
    std::sort(keys_.begin(), keys_.end(), [](const Key& a, const Key& b) { return a.shown < b.shown; });
    if (stamps_.empty() || std::adjacent_find(stamps_.begin(), stamps_.end()) != stamps_.end())
        return Status::error(Code::format,
                             "%s: %zu pictures, some at one time, expected at least 1, one at a time",
                             path_.c_str(), stamps_.size());
    return seek(0);
}

Status FfmpegVideo::open(const std::string& path) {
    path_ = path;
    av_log_set_level(AV_LOG_QUIET);  // what goes wrong is said once, by us
    // Every picture that is stored counts, also what an edit list would hide.
    AVDictionary* options = nullptr;
    av_dict_set(&options, "ignore_editlist", "1", 0);
    int error = avformat_open_input(&input_, path.c_str(), nullptr, &options);
    av_dict_free(&options);
    if (error < 0) return fail("is no video", error);
    error = avformat_find_stream_info(input_, nullptr);
    if (error < 0) return fail("is no whole video", error);
    stream_ = av_find_best_stream(input_, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
    if (stream_ < 0) return fail("has no pictures", stream_);
    BURIN_TRY(open_codec());
    return list_stamps();
}

// To the last key picture that is shown at or before it. Files are in order of decoding, and so is the jump.
Status FfmpegVideo::seek(int index) {
    const std::int64_t stamp = stamps_[static_cast<std::size_t>(index)];
    const auto after = std::upper_bound(keys_.begin(), keys_.end(), stamp,
                                        [](std::int64_t t, const Key& key) { return t < key.shown; });
    const std::int64_t target = after == keys_.begin() ? stamps_.front() : std::prev(after)->decoded;
    const int error = av_seek_frame(input_, stream_, target, AVSEEK_FLAG_BACKWARD);
    if (error < 0) return fail("cannot go back in it", error);
    avcodec_flush_buffers(codec_);
    drained_ = false;
    next_ = 0;  // not known before the first picture comes; never past index
    return {};
}

Status FfmpegVideo::keep() {
    const std::int64_t stamp = frame_->best_effort_timestamp;
    const auto found = std::lower_bound(stamps_.begin(), stamps_.end(), stamp);
    if (found == stamps_.end() || *found != stamp)
        return Status::error(Code::format,
                             "%s: a picture at a time that is not in its index, expected one that is",
                             path_.c_str());
    if (frame_->width != codec_->width || frame_->height != codec_->height)
        return Status::error(Code::format, "%s: a picture of %dx%d, expected %dx%d throughout", path_.c_str(),
                             frame_->width, frame_->height, codec_->width, codec_->height);
    scaler_ = sws_getCachedContext(scaler_, frame_->width, frame_->height,
                                   static_cast<AVPixelFormat>(frame_->format), frame_->width, frame_->height,
                                   AV_PIX_FMT_RGB24, SWS_BILINEAR | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT,
                                   nullptr, nullptr, nullptr);
    if (!scaler_)
        return Status::error(Code::unsupported, "%s: pixel format %d, expected one that converts to RGB",
                             path_.c_str(), frame_->format);
    // Phones write BT.709 or, in old files, BT.601, and say which.
    const int matrix = frame_->colorspace == AVCOL_SPC_UNSPECIFIED ? SWS_CS_ITU709 : frame_->colorspace;
    sws_setColorspaceDetails(scaler_, sws_getCoefficients(matrix), frame_->color_range == AVCOL_RANGE_JPEG,
                             sws_getCoefficients(SWS_CS_ITU709), 1, 0, 1 << 16, 1 << 16);
    Kept& slot = kept_[oldest_];
    oldest_ = (oldest_ + 1) % kKept;
    slot.index = static_cast<int>(found - stamps_.begin());
    next_ = slot.index + 1;
    if (slot.image.empty()) slot.image = Image<std::uint8_t>(frame_->width, frame_->height, 3);
    std::uint8_t* const rows[4] = {slot.image.pixels.data()};
    const int strides[4] = {3 * frame_->width};
    sws_scale(scaler_, frame_->data, frame_->linesize, 0, frame_->height, rows, strides);
    return {};
}

Result<bool> FfmpegVideo::decode_next() {
    while (true) {
        int error = avcodec_receive_frame(codec_, frame_);
        if (error == 0) {
            BURIN_TRY(keep());
            return true;
        }
        if (error == AVERROR_EOF) return false;
        if (error != AVERROR(EAGAIN) || drained_) return fail("is damaged", error);
        error = av_read_frame(input_, packet_);
        if (error == AVERROR_EOF) {
            drained_ = true;
            avcodec_send_packet(codec_, nullptr);
            continue;
        }
        if (error < 0) return fail("cannot be read", error);
        if (packet_->stream_index == stream_) error = avcodec_send_packet(codec_, packet_);
        av_packet_unref(packet_);
        if (error < 0) return fail("is damaged", error);
    }
}

const FfmpegVideo::Kept* FfmpegVideo::kept(int index) const {
    const auto found =
        std::find_if(kept_.begin(), kept_.end(), [index](const Kept& k) { return k.index == index; });
    return found == kept_.end() ? nullptr : &*found;
}

// Goes forward until the picture is kept. Pictures that are shown before the key picture that a jump ended at
// may need one further back, and the codec leaves them out: then the jump is done again, longer.
Status FfmpegVideo::reach(int index) {
    // Past some seconds of pictures a jump is cheaper than decoding what lies between.
    constexpr int kFarAhead = 120;
    int back = 0;
    if (index < next_ || index > next_ + kFarAhead) BURIN_TRY(seek(index));
    while (true) {
        const Result<bool> got = decode_next();
        if (!got) return got.status();
        if (*got && next_ <= index) continue;
        if (*got && next_ == index + 1) return {};
        if (back > index)
            return Status::error(Code::format, "%s: picture %d does not come, expected all %d of its index",
                                 path_.c_str(), index, frame_count());
        back = back == 0 ? 8 : 4 * back;
        BURIN_TRY(seek(std::max(0, index - back)));
    }
}

Status FfmpegVideo::load(int index, Image<std::uint8_t>* out) {
    const std::lock_guard lock(mutex_);
    out->pixels.clear();
    out->width = out->height = 0;
    if (index < 0 || index >= frame_count())
        return Status::error(Code::format, "%s: %d pictures, expected one for frame %d", path_.c_str(),
                             frame_count(), index);
    if (!kept(index))
        if (const Status status = reach(index); !status) {
            next_ = frame_count();  // the next one to ask begins with a jump
            return status;
        }
    *out = kept(index)->image;
    return {};
}

}  // namespace

bool video_is_built() { return true; }

Result<std::unique_ptr<Video>> open_video(const std::string& path) {
    auto video = std::make_unique<FfmpegVideo>();
    BURIN_TRY(video->open(path));
    return std::unique_ptr<Video>(std::move(video));
}

}  // namespace burin
