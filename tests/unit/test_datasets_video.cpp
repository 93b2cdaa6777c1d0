// SPDX-License-Identifier: MIT
// Pictures of a video by number. The videos are written here by FFmpeg's encoders: x265 without loss where it
// is there (HEVC is what phones write), else MPEG-4 with some.
#include <gtest/gtest.h>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <cmath>
#include <filesystem>
#include <thread>

#include "datasets/mp4_size.h"
#include "datasets/open.h"
#include "datasets/video.h"
#include "phone_files.h"

namespace burin {
namespace {

struct Written {
    bool lossless = false;
};

// Pictures at 60 Hz, a key picture every 12, B pictures between as the encoder likes.
Written write_video(const std::string& path, const std::vector<Image<std::uint8_t>>& pictures) {
    const AVCodec* encoder = avcodec_find_encoder_by_name("libx265");
    const Written written{encoder != nullptr};
    if (!encoder) encoder = avcodec_find_encoder(AV_CODEC_ID_MPEG4);
    AVFormatContext* out = nullptr;
    EXPECT_GE(avformat_alloc_output_context2(&out, nullptr, "mp4", path.c_str()), 0);
    AVStream* stream = avformat_new_stream(out, nullptr);
    AVCodecContext* c = avcodec_alloc_context3(encoder);
    c->width = pictures[0].width;
    c->height = pictures[0].height;
    c->time_base = {1, 60};
    c->framerate = {60, 1};
    c->gop_size = 12;
    c->pix_fmt = written.lossless ? AV_PIX_FMT_GBRP : AV_PIX_FMT_YUV420P;
    c->flags |= AV_CODEC_FLAG_GLOBAL_HEADER | AV_CODEC_FLAG_QSCALE;
    c->global_quality = FF_QP2LAMBDA * 2;
    AVDictionary* options = nullptr;
    if (written.lossless) {
        c->colorspace = AVCOL_SPC_RGB;
        av_dict_set(&options, "x265-params", "lossless=1:log-level=none:keyint=12", 0);
    }
    EXPECT_GE(avcodec_open2(c, encoder, &options), 0);
    av_dict_free(&options);
    avcodec_parameters_from_context(stream->codecpar, c);
    stream->time_base = c->time_base;
    EXPECT_GE(avio_open(&out->pb, path.c_str(), AVIO_FLAG_WRITE), 0);
    EXPECT_GE(avformat_write_header(out, nullptr), 0);
    AVFrame* frame = av_frame_alloc();
    AVPacket* packet = av_packet_alloc();
    const auto drain = [&] {
        while (avcodec_receive_packet(c, packet) == 0) {
            av_packet_rescale_ts(packet, c->time_base, stream->time_base);
            packet->stream_index = stream->index;
            EXPECT_GE(av_interleaved_write_frame(out, packet), 0);
        }
    };
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        frame->format = c->pix_fmt;
        frame->width = c->width;
        frame->height = c->height;
        frame->pts = static_cast<std::int64_t>(i);
        EXPECT_GE(av_frame_get_buffer(frame, 0), 0);
        for (int y = 0; y < c->height; ++y)
            for (int x = 0; x < c->width; ++x) {
                const std::uint8_t* rgb = &pictures[i].pixels[3 * std::size_t(y * c->width + x)];
                if (written.lossless) {
                    for (int p = 0; p < 3; ++p)  // planes: green, blue, red
                        frame->data[p][y * frame->linesize[p] + x] = rgb[(p + 1) % 3];
                } else {
                    frame->data[0][y * frame->linesize[0] + x] =
                        static_cast<std::uint8_t>(16 + rgb[1] * 219 / 255);
                    for (int p = 1; p < 3; ++p) frame->data[p][y / 2 * frame->linesize[p] + x / 2] = 128;
                }
            }
        EXPECT_GE(avcodec_send_frame(c, frame), 0);
        av_frame_unref(frame);
        drain();
    }
    avcodec_send_frame(c, nullptr);
    drain();
    av_write_trailer(out);
    avio_closep(&out->pb);
    avcodec_free_context(&c);
    avformat_free_context(out);
    av_packet_free(&packet);
    av_frame_free(&frame);
    return written;
}

// A grey of its own each, so that a wrong picture shows.
std::vector<Image<std::uint8_t>> greys(int count) {
    std::vector<Image<std::uint8_t>> all;
    for (int i = 0; i < count; ++i) {
        Image<std::uint8_t> image(64, 48, 3, static_cast<std::uint8_t>(20 + 5 * i));
        all.push_back(image);
    }
    return all;
}

void expect_grey(Video& video, int index) {
    Image<std::uint8_t> image;
    const Status status = video.load(index, &image);
    ASSERT_TRUE(status.ok()) << status.text();
    EXPECT_EQ(image.width, 64);
    double sum = 0;
    for (std::uint8_t v : image.pixels) sum += v;
    EXPECT_NEAR(sum / double(image.pixels.size()), 20 + 5 * index, 2) << index;
}

TEST(Video, AnyPictureInAnyOrder) {
    const TempFolder folder;
    write_video(folder.path("a.mp4"), greys(40));
    auto video = open_video(folder.path("a.mp4"));
    ASSERT_TRUE(video.ok()) << video.status().text();
    ASSERT_EQ((*video)->frame_count(), 40);
    for (int i = 0; i < 40; ++i) expect_grey(**video, i);
    for (int i = 39; i >= 0; --i) expect_grey(**video, i);
    for (int i = 0; i < 40; ++i) expect_grey(**video, 17 * i % 40);
    Image<std::uint8_t> image;
    EXPECT_FALSE((*video)->load(40, &image).ok());
    RandomFile file;
    ASSERT_TRUE(file.open(folder.path("a.mp4")).ok());
    const auto size = mp4_picture_size(file);
    ASSERT_TRUE(size.ok()) << size.status().text();
    EXPECT_EQ(size->width, 64);
    EXPECT_EQ(size->height, 48);
}

TEST(Video, ByManyThreads) {
    const TempFolder folder;
    write_video(folder.path("a.mp4"), greys(40));
    auto video = open_video(folder.path("a.mp4"));
    ASSERT_TRUE(video.ok()) << video.status().text();
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            for (int i = t; i < 40; i += 4) expect_grey(**video, i);
        });
    for (std::thread& thread : threads) thread.join();
}

TEST(Video, CutFilesAreErrors) {
    const TempFolder folder;
    write_video(folder.path("a.mp4"), greys(24));
    const std::string whole = read_bytes(folder.path("a.mp4"));
    for (int i = 0; i < 10; ++i) {
        const std::string path =
            folder.text("cut.mp4", whole.substr(0, whole.size() * static_cast<std::size_t>(i) / 10));
        auto video = open_video(path);
        Image<std::uint8_t> image;
        Status status = video.ok() ? Status() : video.status();
        for (int k = 0; status.ok() && k < (*video)->frame_count(); ++k) status = (*video)->load(k, &image);
        EXPECT_FALSE(status.ok());
        EXPECT_NE(std::string(status.text()).find(path), std::string::npos) << status.text();
    }
}

TEST(Video, StrayWithItsColour) {
    const TempFolder folder;
    const std::vector<Shot> shots = room_shots(4, 160, 120);
    write_stray(folder, shots);
    std::vector<Image<std::uint8_t>> pictures;
    for (const Shot& s : shots) pictures.push_back(s.rgb);
    const Written written = write_video(folder.path("rgb.mp4"), pictures);
    auto dataset = open_dataset(folder.path(), "");
    ASSERT_TRUE(dataset.ok()) << dataset.status().text();
    EXPECT_EQ((*dataset)->notes(), "");
    Frame f;
    for (int i : {2, 0, 3, 1}) {
        const Status status = (*dataset)->load(i, &f);
        ASSERT_TRUE(status.ok()) << status.text();
        const Shot& s = shots[static_cast<std::size_t>(i)];
        EXPECT_EQ(f.depth_u16.pixels, s.depth_mm.pixels);
        EXPECT_EQ(f.depth_camera.fx, s.camera.fx);
        EXPECT_EQ(f.colour_camera.cx, s.camera.cx);
        if (written.lossless) {
            EXPECT_EQ(f.colour.pixels, s.rgb.pixels);
        }
    }
}

}  // namespace
}  // namespace burin
