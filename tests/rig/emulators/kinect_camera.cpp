// SPDX-License-Identifier: MIT
// rig_kinect: a Kinect v1 on vhci_hcd: the camera (045e:02ae) with depth of 11 or 10 bits and Bayer, UYVY or
// infrared video, both isochronous, and the motor (045e:02b0) with its accelerometer.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "arguments.h"
#include "ps_protocol.h"

namespace rig {
namespace {

constexpr char kUsage[] =
    "rig_kinect [--fps N] [--frames FILE] [--still N] [--hold N] [--calibration good|zero|nan|negative|huge] "
    "[--no-motor] [-f "
    "COMMAND]... [-F FIFO]\n";

constexpr int kDepthChunk = 1748, kVideoChunk = 1908;  // what real ones send
constexpr unsigned kPacket = 0x0bc0;                   // two transactions of 960 bytes a microframe

class KinectCamera : public PsControl {
  public:
    KinectCamera(Faults& faults, const Picture& picture, const std::string& calibration, int fps)
        : PsControl(faults),
          picture_(picture),
          constants_(PsConstants::named(calibration)),
          fps_(fps),
          table_() {
        if (picture.recorded()) constants_.set_focal_length(picture.fx() * 640 / picture.depth_width());
        table_ = ps_shift_table(constants_);
        device = {18, 1, 0x00, 0x02, 0, 0, 0, 64, 0x5e, 0x04, 0xae, 0x02, 0x0b, 0x01, 2, 1, 3, 1};
        config = {9, 2, 32, 0, 1, 1, 0, 0xc0, 8, 9, 4, 0, 0, 2, 255, 255, 255, 0};
        for (const int endpoint : {0x81, 0x82}) {
            config.insert(config.end(), {7, 5, static_cast<std::uint8_t>(endpoint), 1});
            put16(config, kPacket);
            config.push_back(1);
        }
        strings = {"Xbox NUI Camera", "Microsoft", "A00362913019107A"};
        depth_.byte_sequence = video_.byte_sequence = true;
    }

    void reset() override {
        std::memset(registers_, 0, sizeof registers_);
        depth_.stop(), video_.stop();
    }

    int in(int endpoint, std::uint8_t* out, int size) override {
        if (endpoint == 2)
            return depth_.packet(out, size, fps_, faults_, true, [&](std::uint32_t n, auto& image) {
                paint_depth(picture_.number(n), image);
            });
        return video_.packet(out, size, fps_, faults_, !depth_.on(),
                             [&](std::uint32_t n, auto& image) { paint_video(picture_.number(n), image); });
    }

  protected:
    int command(int opcode, const std::uint8_t* a, int bytes, std::vector<std::uint8_t>* reply) override {
        const unsigned a0 = get16(a), a1 = get16(a + 2);
        switch (opcode) {
            case 0x02:
                put16(*reply, registers_[a0 & 0x3ff]);
                return 0;
            case 0x03:
                if (bytes < 4) return 4;
                registers_[a0 & 0x3ff] = static_cast<std::uint16_t>(a1);
                if (a0 == 5) a1 != 0 ? video_.start() : video_.stop();
                if (a0 == 6) a1 != 0 ? depth_.start() : depth_.stop();
                return 0;
            case 0x04:  // fixed parameters: 322 bytes with the code; the floats at byte 94
                reply->assign(320, 0);
                constants_.write(&(*reply)[92]);
                return 0;
            case 0x16: {  // parameters of the algorithms; lengths count the code
                const int what = static_cast<int>(a0);
                if (what == 0x41)
                    reply->assign(6, 0);  // padding of registered depth: none
                else if (what == 0x40)
                    *reply = ps_registration();
                else if (what == 0)
                    put16(*reply, static_cast<unsigned>(constants_.shift));
                else
                    return 5;
                return 0;
            }
            case 0x95:  // registers of the colour sensor
                put16(*reply, a1), put16(*reply, 0);
                return 0;
            default:
                return 0;
        }
    }

  private:
    void paint_depth(std::uint32_t n, std::vector<std::uint8_t>& image) const {
        const Format f = {Layout::packed, registers_[0x12] == 2 ? 10 : 11, 640, 480};
        image.resize(format_bytes(f));
        if (!picture_.recorded()) return pattern_fill(f, n, image.data());
        format_fill(f, image.data(), [&](int x, int y) -> std::uint32_t {
            const int mm = picture_.depth_mm(n, x, y);
            const std::uint32_t s = mm > 0 && mm <= 10000 ? table_[static_cast<std::size_t>(mm)] : 2047;
            return f.bits == 10 ? s / 2 : s;
        });
    }

    void paint_video(std::uint32_t n, std::vector<std::uint8_t>& image) const {
        Format f;
        if (registers_[5] == 3) {
            const bool big = registers_[0x1a] == 2;
            f = {Layout::packed, 10, big ? 1280 : 640, big ? 1024 : 488};
        } else {
            const bool big = registers_[0x0d] == 2, yuv = registers_[0x0c] == 5;
            f = {Layout::u8, 8, (big ? 1280 : 640) * (yuv ? 2 : 1), big ? 1024 : 480};
        }
        image.resize(format_bytes(f));
        if (!picture_.recorded()) return pattern_fill(f, n, image.data());
        const bool yuv = f.columns == 1280 && f.rows == 480, infrared = f.bits == 10;
        format_fill(f, image.data(), [&](int column, int y) -> std::uint32_t {
            std::uint8_t c[3];
            picture_.rgb(n, yuv ? column / 2 : column, y, c);
            if (infrared) return static_cast<std::uint32_t>(luma(c)) << 2;
            if (yuv) return column % 2 == 1 ? luma(c) : column % 4 == 0 ? chroma_u(c) : chroma_v(c);
            return y % 2 == 0 ? c[column % 2 == 0 ? 1 : 0] : c[column % 2 == 0 ? 2 : 1];  // GRBG
        });
    }

    const Picture& picture_;
    PsConstants constants_;
    int fps_;
    std::vector<std::uint16_t> table_;
    PsStream depth_{0x70, kDepthChunk}, video_{0x80, kVideoChunk};
    std::uint16_t registers_[0x400] = {};
};

// C0/32 tells 10 bytes: acceleration as three big-endian words at 2 (819 counts are 1 g), twice the tilt in
// degrees at 8, status at 9. 40/31 sets the tilt, 40/06 the LED.
class KinectMotor : public UsbDevice {
  public:
    KinectMotor() {
        device = {18, 1, 0x00, 0x02, 0, 0, 0, 64, 0x5e, 0x04, 0xb0, 0x02, 0x05, 0x01, 1, 2, 0, 1};
        config = {9, 2, 18, 0, 1, 1, 0, 0xc0, 50, 9, 4, 0, 0, 0, 255, 0, 0, 0};
        strings = {"Microsoft", "Xbox NUI Motor"};
    }
    int control(const Setup& setup, std::uint8_t* data) override {
        switch (setup.type << 8 | setup.request) {
            case 0xc010:
                data[0] = 0x22;
                return 1;
            case 0xc032: {
                const int xyz[3] = {41, 812, -123};
                std::uint8_t b[10] = {};
                for (int i = 0; i < 3; ++i)
                    b[2 + 2 * i] = static_cast<std::uint8_t>(xyz[i] >> 8),
                              b[3 + 2 * i] = static_cast<std::uint8_t>(xyz[i]);
                b[8] = static_cast<std::uint8_t>(tilt_);
                std::memcpy(data, b, std::min<std::size_t>(setup.length, sizeof b));
                return 10;
            }
            case 0x4031:
                tilt_ = static_cast<std::int16_t>(setup.value);
                return 0;
            case 0x4006:
                return 0;
            default:
                return kStall;
        }
    }
    int in(int, std::uint8_t*, int) override { return kLater; }

  private:
    int tilt_ = 10;
};

}  // namespace
}  // namespace rig

int main(int argc, char** argv) {
    rig::Arguments arguments(argc, argv, rig::kUsage, {"--fps", "--calibration"}, {"--no-motor"});
    rig::KinectCamera camera(arguments.faults, arguments.picture, arguments.get("--calibration", "good"),
                             arguments.fps());
    rig::KinectMotor motor;
    rig::VirtualBus bus(arguments.faults);
    bus.add(camera);
    if (!arguments.has("--no-motor")) bus.add(motor);
    return bus.run();
}
