// SPDX-License-Identifier: MIT
// rig_ps1080: a PrimeSense PS1080 (as in Xtion, Carmine, Structure Sensor) on vhci_hcd: depth in the formats
// 0 to 4, image as UYVY, YUYV or Bayer, infrared; bulk in alternate setting 0, isochronous in 1.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "arguments.h"
#include "ps_compression.h"
#include "ps_protocol.h"

namespace rig {
namespace {

constexpr char kUsage[] =
    "rig_ps1080 [--id VENDOR:PRODUCT] [--firmware MAJOR.MINOR] [--astra] [--fps N] [--frames FILE] [--still "
    "N] [--hold N]\n"
    "           [--calibration good|zero|nan|negative|huge] [-f COMMAND]... [-F FIFO]\n"
    "--firmware: before 5.5 alternate setting 0 is isochronous and 1 bulk, before 5.2 depth comes from "
    "endpoint 82\n"
    "--astra: packed depth of 11 bits whatever is asked for, in packets of 3060 bytes, with that sensor's "
    "constants\n";

constexpr int kDepthChunk = 1748, kImageChunk = 1908, kAstraChunk = 3060;

// Parameters by number (opcodes 2 and 3).
enum : unsigned {
    kRegistration = 2,
    kStream0 = 5,
    kStream1 = 6,
    kImageFormat = 12,
    kImageSize = 13,
    kDepthFormat = 18,
    kDepthSize = 19,
    kDepthMirror = 23,
    kInfraredSize = 26,
    kImageMirror = 71,
    kInfraredMirror = 72
};

struct Size {
    int width, height;
};

Size size_of(unsigned resolution) {
    static constexpr Size sizes[] = {{320, 240}, {640, 480}, {1280, 1024}, {1600, 1200}, {160, 120}};
    return sizes[resolution <= 4 ? resolution : 1];
}

class Ps1080 : public PsControl {
  public:
    Ps1080(const Arguments& arguments, Faults& faults)
        : PsControl(faults),
          picture_(arguments.picture),
          constants_(PsConstants::named(arguments.get("--calibration", "good"))),
          fps_(arguments.fps()),
          astra_(arguments.has("--astra")),
          depth_(0x70, astra_ ? kAstraChunk : kDepthChunk) {
        unsigned vendor = 0x1d27, product = 0x0601;
        arguments.id(&vendor, &product);
        std::sscanf(arguments.get("--firmware", "5.8").c_str(), "%d.%d", &major_, &minor_);
        const bool swapped = version() < 502;
        depth_endpoint_ = swapped ? 2 : 1;
        iso_setting_ = version() < 505 ? 0 : 1;
        if (astra_) constants_.reference_distance = 130, constants_.pixel_size = 0.113967f;
        if (picture_.recorded()) constants_.set_focal_length(picture_.fx() * 640 / picture_.depth_width());
        table_ = ps_shift_table(constants_);
        device = {18, 1, 0x00, 0x02, 0, 0, 0, 64};
        put16(device, vendor), put16(device, product), put16(device, 0x0100);
        device.insert(device.end(), {2, 1, 0, 1});
        config = {9, 2, 0, 0, 1, 1, 0, 0x80, 250};
        const auto endpoint = [&](int address, int type, unsigned packet, int interval) {
            config.insert(config.end(),
                          {7, 5, static_cast<std::uint8_t>(address), static_cast<std::uint8_t>(type)});
            put16(config, packet);
            config.push_back(static_cast<std::uint8_t>(interval));
        };
        for (int setting = 0; setting < 2; ++setting) {
            config.insert(config.end(), {9, 4, 0, static_cast<std::uint8_t>(setting), 2, 255, 0, 0, 0});
            const bool iso = setting == iso_setting_;
            for (int number = 1; number <= 2; ++number)
                endpoint(0x80 | number, iso ? 1 : 2,
                         !iso                                   ? 512
                         : number == depth_endpoint_ && !astra_ ? 0x0bc0
                                                                : 0x1400,
                         iso ? 1 : 0);
        }
        set16(&config[2], static_cast<unsigned>(config.size()));
        strings = {"PrimeSense Device", "PrimeSense"};
        depth_.padding_field = true;
    }

    void reset() override {
        std::memset(parameters_, 0, sizeof parameters_);
        parameters_[kDepthFormat] = 3, parameters_[kDepthSize] = 1, parameters_[kImageFormat] = 5,
        parameters_[kImageSize] = 1;
        parameters_[kInfraredSize] = 1;
        depth_.stop(), image_.stop();
    }

    void set_alternate(int, int) override { depth_.stop(), image_.stop(); }

    int in(int endpoint, std::uint8_t* out, int size) override {
        const bool iso = alternate[0] == iso_setting_;
        const auto depth = [&](std::uint32_t n, auto& v) { paint_depth(picture_.number(n), v); };
        const auto image = [&](std::uint32_t n, auto& v) { paint_image(picture_.number(n), v); };
        if (endpoint == depth_endpoint_)
            return iso ? depth_.packet(out, size, fps_, faults_, true, depth)
                       : depth_.bytes(out, size, fps_, faults_, true, depth);
        if (endpoint == 3 - depth_endpoint_)
            return iso ? image_.packet(out, size, fps_, faults_, !depth_.on(), image)
                       : image_.bytes(out, size, fps_, faults_, !depth_.on(), image);
        return kLater;
    }

  protected:
    int command(int opcode, const std::uint8_t* a, int bytes, std::vector<std::uint8_t>* reply) override {
        const unsigned a0 = get16(a), a1 = get16(a + 2);
        const auto zeros = [&](std::size_t n) { reply->assign(n, 0); };
        switch (opcode) {
            case 0:  // version: minor, major, build (binary-coded decimal), chip, FPGA, system
                *reply = {static_cast<std::uint8_t>(minor_),
                          static_cast<std::uint8_t>(major_),
                          0x22,
                          0,
                          0x20,
                          0x20,
                          0x20,
                          0,
                          5,
                          0,
                          1,
                          0};
                reply->resize(60, 0);
                return 0;
            case 1:
            case 6:
            case 34:
            case 41:
            case 42:
                return 0;
            case 2:
                put16(*reply, parameters_[a0 & 0x3ff]);
                return 0;
            case 3:
                if (bytes < 4) return 4;
                parameters_[a0 & 0x3ff] = static_cast<std::uint16_t>(a1);
                if (a0 == kStream0) a1 != 0 ? image_.start() : image_.stop();
                if (a0 == kStream1) a1 == 2 ? depth_.start() : depth_.stop();
                return 0;
            case 4: {  // fixed parameters from an offset in 32-bit words
                std::vector<std::uint8_t> all(168, 0);
                set32(&all[4 * 14], 1);  // depth sensor MT9M001, whose infrared images have 8 rows more
                set32(&all[4 * 19], 2);  // image sensor MT9D131; 0 would say that there is none
                constants_.write(&all[92]);
                if (4 * a0 < all.size()) reply->assign(all.begin() + 4 * static_cast<int>(a0), all.end());
                return 0;
            }
            case 5:
                put16(*reply, 1);
                return 0;  // mode: streaming
            case 11:
            case 35:
            case 40:
                return zeros(2), 0;
            case 20:
                return zeros(4), 0;
            case 22:
                return algorithm(a0, 2 * get16(a + 8), *reply);
            case 36:  // modes of the image sensor: format, resolution, rate
                for (const unsigned format : {5u, 7u, 6u, 1u, 0u})
                    for (const unsigned resolution : {0u, 1u})
                        put16(*reply, format), put16(*reply, resolution), put16(*reply, 30);
                put16(*reply, 6), put16(*reply, 2), put16(*reply, 30);
                return 0;
            case 37:
                for (const char c : {'E', 'M', 'U', '0', '0', '0', '0', '0', '0', '0', '0', '0', '0', '0',
                                     '0', '1', '\0', '\0'})
                    reply->push_back(static_cast<std::uint8_t>(c));
                return 0;
            case 39:
                *reply = {'e', 'm', 'u', 0, 0, 0, 0, 0};
                return 0;
            default:
                return 2;
        }
    }

  private:
    int version() const { return 100 * major_ + minor_; }

    int algorithm(unsigned what, std::size_t offset, std::vector<std::uint8_t>& reply) const {
        std::vector<std::uint8_t> all;
        switch (what) {
            case 0x00:
                put16(all, static_cast<unsigned>(constants_.shift));
                break;
            case 0x02:
                all = ps_registration();
                break;
            case 0x03:
                all.assign(6, 0);
                break;
            case 0x06:
                all.assign(16, 0);
                break;
            case 0x07:
                all.assign(256, 0);
                std::memcpy(all.data(), "PS1080", 6);
                break;
            case 0x80: {
                const float mhz = 60;
                all.resize(4);
                std::memcpy(all.data(), &mhz, 4);
                break;
            }
            default:
                return 5;
        }
        if (offset < all.size()) reply.assign(all.begin() + static_cast<std::ptrdiff_t>(offset), all.end());
        return 0;
    }

    int shift(std::uint32_t n, int x, int y) const {
        if (!picture_.recorded())
            return static_cast<int>(pattern(n, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)) &
                                    2047);
        const int mm = picture_.depth_mm(n, x, y);
        return mm > 0 && mm <= 10000 ? table_[static_cast<std::size_t>(mm)] : 2047;
    }

    unsigned depth_format() const { return astra_ ? 3u : parameters_[kDepthFormat]; }

    void paint_depth(std::uint32_t n, std::vector<std::uint8_t>& out) const {
        const int w = size_of(parameters_[kDepthSize]).width, h = size_of(parameters_[kDepthSize]).height;
        const bool mirror = parameters_[kDepthMirror] != 0;
        const auto at = [&, width = w](int x, int y) {
            return static_cast<std::uint32_t>(shift(n, mirror ? width - 1 - x : x, y));
        };
        if (depth_format() == 1) {
            compress_depth(w, h, at, out);
            return;
        }
        const unsigned format = depth_format();
        const Format f = format == 0 ? Format{Layout::u16, 16, w, h}
                                     : Format{Layout::packed,
                                              format == 2   ? 10
                                              : format == 4 ? 12
                                                            : 11,
                                              w, h};
        out.resize(format_bytes(f));
        format_fill(f, out.data(), at);
    }

    void paint_image(std::uint32_t n, std::vector<std::uint8_t>& out) const {
        plain_image(n, out);
        const unsigned format = parameters_[kImageFormat];
        if (parameters_[kStream0] == 3 || format > 1) return;
        const int columns = size_of(parameters_[kImageSize]).width * (format == 1 ? 2 : 1);
        const std::vector<std::uint8_t> plain(out);
        compress_image(plain, columns, format == 1, out);
    }

    void plain_image(std::uint32_t n, std::vector<std::uint8_t>& out) const {
        const bool infrared = parameters_[kStream0] == 3;
        const Size size = size_of(parameters_[infrared ? kInfraredSize : kImageSize]);
        const int w = size.width, rows = size.height;
        const int h = infrared && rows < 1024 ? rows + 8 : rows;
        const unsigned format = parameters_[kImageFormat];
        const bool yuv = !infrared && format != 6 && format != 0,
                   mirror = parameters_[infrared ? kInfraredMirror : kImageMirror] != 0;
        const Format f =
            infrared ? Format{Layout::packed, 10, w, h} : Format{Layout::u8, 8, yuv ? 2 * w : w, h};
        out.resize(format_bytes(f));
        if (!picture_.recorded()) {
            if (!mirror) return pattern_fill(f, n, out.data());
            // Pairs of pixels swap places, and the two lumas in each.
            return format_fill(f, out.data(), [&, width = w](int c, int y) {
                if (!yuv)
                    return pattern(n, static_cast<std::uint32_t>(width - 1 - c),
                                   static_cast<std::uint32_t>(y));
                const int luma_at = format == 7 ? 0 : 1, pair = width / 2 - 1 - c / 4;
                const int k = c % 2 == luma_at ? (c + 2) % 4 : c % 4;
                return pattern(n, static_cast<std::uint32_t>(4 * pair + k), static_cast<std::uint32_t>(y));
            });
        }
        format_fill(f, out.data(), [&, width = w](int column, int y) -> std::uint32_t {
            std::uint8_t c[3];
            int x = yuv ? column / 2 : column;
            if (mirror) x = width - 1 - x;
            picture_.rgb(n, x, y, c);
            if (infrared) return static_cast<std::uint32_t>(luma(c)) << 2;
            if (!yuv) return y % 2 == 0 ? c[column % 2 == 0 ? 1 : 0] : c[column % 2 == 0 ? 2 : 1];  // GRBG
            const int luma_at = format == 7 ? 0 : 1;
            return column % 2 == luma_at ? luma(c) : column % 4 < 2 ? chroma_u(c) : chroma_v(c);
        });
    }

    const Picture& picture_;
    PsConstants constants_;
    int fps_;
    bool astra_;
    int major_ = 5, minor_ = 8, depth_endpoint_ = 1, iso_setting_ = 1;
    std::vector<std::uint16_t> table_;  // shift by millimetre
    PsStream depth_, image_{0x80, kImageChunk};
    std::uint16_t parameters_[0x400] = {};
};

}  // namespace
}  // namespace rig

int main(int argc, char** argv) {
    rig::Arguments arguments(argc, argv, rig::kUsage, {"--id", "--firmware", "--fps", "--calibration"},
                             {"--astra"});
    rig::Ps1080 camera(arguments, arguments.faults);
    rig::VirtualBus bus(arguments.faults);
    bus.add(camera);
    return bus.run();
}
