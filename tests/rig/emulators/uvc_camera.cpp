// SPDX-License-Identifier: MIT
// rig_uvc_camera: a UVC depth camera on vhci_hcd, with depth, infrared and colour streams, bulk or
// isochronous, and what a RealSense D4xx tells of itself.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <jpeglib.h>  // after <cstdio>: it has no includes of its own

#include "arguments.h"
#include "d4xx.h"
#include "uvc_descriptors.h"
#include "vusb.h"

namespace rig {
namespace {

constexpr char kUsage[] =
    "rig_uvc_camera [--iso] [--id VENDOR:PRODUCT] [--fps N] [--payload BYTES] [--frames FILE] [--still N] "
    "[--hold N] "
    "[--calibration "
    "NAME] [--absurd NAME]\n"
    "               [-f COMMAND]... [-F FIFO]\n"
    "--payload 0 (default): one payload a frame in bulk, with D4XX metadata in its header\n"
    "--calibration good|none|zero|nan|huge|crc|short|type   --absurd "
    "zero-size|huge-size|zero-interval|no-formats|cut|no-endpoint\n";

std::vector<std::uint8_t> encode_jpeg(int width, int height, const std::vector<std::uint8_t>& rgb) {
    jpeg_compress_struct c{};
    jpeg_error_mgr errors{};
    c.err = jpeg_std_error(&errors);
    jpeg_create_compress(&c);
    unsigned char* memory = nullptr;
    unsigned long size = 0;
    jpeg_mem_dest(&c, &memory, &size);
    c.image_width = static_cast<JDIMENSION>(width);
    c.image_height = static_cast<JDIMENSION>(height);
    c.input_components = 3;
    c.in_color_space = JCS_RGB;
    jpeg_set_defaults(&c);
    c.comp_info[0].v_samp_factor = 1;  // 4:2:2, as cameras send
    jpeg_set_quality(&c, 90, TRUE);
    jpeg_start_compress(&c, TRUE);
    while (c.next_scanline < c.image_height) {
        JSAMPROW row = const_cast<JSAMPROW>(&rgb[3 * static_cast<std::size_t>(width) * c.next_scanline]);
        jpeg_write_scanlines(&c, &row, 1);
    }
    jpeg_finish_compress(&c);
    std::vector<std::uint8_t> out(memory, memory + size);
    std::free(memory);
    jpeg_destroy_compress(&c);
    return out;
}

class UvcCamera : public UsbDevice {
  public:
    UvcCamera(const UvcConfig& how, int payload, const std::string& calibration, const Picture& picture,
              Faults& faults)
        : config_(how), payload_(payload), d4xx_(faults, calibration), picture_(picture), faults_(faults) {
        device = uvc_device_descriptor(how);
        config = uvc_configuration(how);
        if (picture.recorded()) {
            // The tables are for 480 rows.
            const double k = 480.0 / picture.depth_height();
            D4xxTruth& t = d4xx_.truth;
            t.fx = t.colour_fx = static_cast<float>(k * picture.fx());
            t.fy = t.colour_fy = static_cast<float>(k * picture.fy());
            t.cx = t.colour_cx = static_cast<float>(320 + k * (picture.cx() - picture.depth_width() / 2.0));
            t.cy = t.colour_cy = static_cast<float>(k * picture.cy());
            for (float& v : t.colour_t_mm) v = 0;
        }
        strings = {"Burin rig", "Emulated depth camera", "826312070591"};
        reset();
    }

    void reset() override {
        streams_.assign(uvc_streams().size(), Stream());
        for (std::size_t i = 0; i < streams_.size(); ++i) streams_[i].kind = &uvc_streams()[i];
        d4xx_.reset();
    }

    int control(const Setup& setup, std::uint8_t* data) override {
        const int selector = setup.value >> 8, unit = setup.index >> 8, interface = setup.index & 255;
        if (interface == 0 && unit == kUvcExtensionUnit)
            return d4xx_.extension(setup.request, selector, data, setup.length);
        for (Stream& s : streams_)
            if (s.kind->interface == interface && (selector == 1 || selector == 2))
                return negotiate(s, setup.request, selector == 2, data, setup.length);
        return kStall;
    }

    void set_alternate(int interface, int number) override {
        for (Stream& s : streams_)
            if (s.kind->interface == interface) number != 0 ? start(s) : stop(s);
    }

    int in(int endpoint, std::uint8_t* out, int size) override {
        for (Stream& s : streams_)
            if (s.kind->endpoint == endpoint)
                return config_.bulk ? bulk_in(s, out, size) : iso_in(s, out, size);
        return kLater;
    }

  private:
    struct Stream {
        const UvcStreamKind* kind = nullptr;
        std::uint8_t probe[34] = {};
        bool on = false, middle_told = false;
        int format = 0, size = 0, fps = 30;
        std::uint32_t frame = 0, max_payload = 0;
        std::uint8_t fid = 0;
        double next_at = 0;
        std::vector<std::uint8_t> image;
        std::size_t pos = 0;                // of image
        std::vector<std::uint8_t> payload;  // bulk: header and body now on their way
        std::size_t payload_pos = 0;
        bool last = false;         // it ends the frame
        bool end_payload = false;  // a packet of no bytes has to end it
        const UvcFormat& f() const { return kind->formats[static_cast<std::size_t>(format)]; }
        UvcSize wh() const { return kind->sizes[static_cast<std::size_t>(size)]; }
    };

    void start(Stream& s) {
        s.on = true;
        s.frame = 0, s.fid = 0, s.pos = 0, s.payload_pos = 0;
        s.payload.clear(), s.image.clear();
        s.end_payload = false;
        s.next_at = now_s();
    }
    void stop(Stream& s) { s.on = false; }

    std::uint32_t max_payload(const Stream& s) const {
        if (!config_.bulk) return 3072;
        return payload_ > 0 ? static_cast<std::uint32_t>(payload_)
                            : uvc_frame_bytes(s.f(), s.wh()) + 12 + 140;
    }

    // VS_PROBE_CONTROL and VS_COMMIT_CONTROL: 34 bytes, UVC 1.1 table 4-75.
    int negotiate(Stream& s, int request, bool commit, std::uint8_t* data, int length) {
        switch (request) {
            case 0x01: {
                std::memcpy(s.probe, data, static_cast<std::size_t>(std::min(length, 34)));
                const int format = s.probe[2], size = s.probe[3];
                s.format = format >= 1 && format <= static_cast<int>(s.kind->formats.size()) ? format - 1 : 0;
                s.size = size >= 1 && size <= static_cast<int>(s.kind->sizes.size()) ? size - 1 : 0;
                if (commit) {
                    std::printf("emulator: %s streams %.4s %dx%d\n", s.kind->name, s.f().fourcc, s.wh().width,
                                s.wh().height);
                    if (config_.bulk) start(s);
                }
                return length;
            }
            case 0x85:
                set16(data, 34);
                return 2;
            case 0x86:
                data[0] = 3;
                return 1;
            case 0x81:
            case 0x82:
            case 0x83:
            case 0x87: {
                std::uint8_t p[34];
                std::memcpy(p, s.probe, 34);
                p[2] = static_cast<std::uint8_t>(s.format + 1);
                p[3] = static_cast<std::uint8_t>(s.size + 1);
                set32(p + 4, static_cast<std::uint32_t>(10000000 / config_.fps));
                set32(p + 18, uvc_frame_bytes(s.f(), s.wh()));
                set32(p + 22, max_payload(s));
                set32(p + 26, kUvcClockHz);
                if (faults_.take("probe_size")) set32(p + 18, 0x7fffffff);
                std::memcpy(data, p, static_cast<std::size_t>(std::min(length, 34)));
                return 34;
            }
            default:
                return kStall;
        }
    }

    void paint(Stream& s) {
        const UvcFormat& f = s.f();
        const std::uint32_t n = picture_.number(s.frame);
        const int w = s.wh().width, h = s.wh().height;
        if (f.jpeg) {
            std::vector<std::uint8_t> rgb(3 * static_cast<std::size_t>(w) * h);
            std::vector<std::uint8_t>& kept = jpegs_[s.size][n % 24];
            if (kept.empty() || picture_.recorded()) {
                for (int y = 0; y < h; ++y)
                    for (int x = 0; x < w; ++x) {
                        std::uint8_t* p = &rgb[3 * (static_cast<std::size_t>(y) * w + x)];
                        if (picture_.recorded())
                            picture_.rgb(n, x, y, p);
                        else
                            p[0] = p[1] = p[2] = pattern_jpeg_grey(n, static_cast<std::uint32_t>(x),
                                                                   static_cast<std::uint32_t>(y));
                    }
                kept = encode_jpeg(w, h, rgb);
            }
            s.image = kept;
            return;
        }
        const Format pixels = uvc_pixels(f, s.wh());
        s.image.resize(format_bytes(pixels));
        if (!picture_.recorded())
            pattern_fill(pixels, n, s.image.data());
        else if (s.kind->endpoint == 1)
            format_fill(pixels, s.image.data(), [&](int x, int y) { return picture_.depth_mm(n, x, y % h); });
        else {
            const int per = f.samples, luma_at = std::strcmp(f.fourcc, "UYVY") == 0 ? 1 : 0;
            format_fill(pixels, s.image.data(), [&](int column, int y) -> std::uint32_t {
                std::uint8_t c[3];
                const int x = column / per;
                picture_.rgb(n, x, y, c);
                if (s.kind->endpoint == 2) return static_cast<std::uint32_t>(luma(c)) << (f.sample_bits - 8);
                if (column % 2 == luma_at) return luma(c);
                picture_.rgb(n, x & ~1, y, c);  // chroma of the left one of two
                return x % 2 == 0 ? chroma_u(c) : chroma_v(c);
            });
        }
    }

    bool begin_frame(Stream& s) {
        if (now_s() < s.next_at) return false;
        paint(s);
        s.middle_told = false;
        if (faults_.take("short_frame")) s.image.resize(s.image.size() / 2);
        if (faults_.take("long_frame")) s.image.resize(s.image.size() + 4096, 0xee);
        return true;
    }

    void end_frame(Stream& s) {
        s.pos = 0;
        if (!faults_.take("stuck_frame_id")) s.fid ^= 1;
        ++s.frame;
        if (faults_.take("lost_frame")) ++s.frame;
        // A late emulator does not catch up: a camera would not either.
        s.next_at = std::max(s.next_at + 1.0 / config_.fps, now_s() - 1.0 / config_.fps);
    }

    // Header of the payload that begins at s.pos, UVC 1.1 section 2.4.3.3: end of header, PTS and SCR always.
    std::vector<std::uint8_t> header(const Stream& s) {
        const double now = now_s();
        std::vector<std::uint8_t> h = {12, static_cast<std::uint8_t>(0x8c | s.fid)};
        put32(h, static_cast<std::uint32_t>(static_cast<std::uint64_t>(s.frame) *
                                            (kUvcClockHz / static_cast<unsigned>(config_.fps))));
        put32(h, static_cast<std::uint32_t>(static_cast<std::uint64_t>(now * kUvcClockHz)));
        put16(h, static_cast<unsigned>(now * 1000) & 0x7ff);  // USB frame number
        if (config_.bulk && payload_ == 0) {
            const std::vector<std::uint8_t> meta =
                d4xx_.metadata(s.frame, s.f().d4xx, s.wh().width, s.wh().height, config_.fps);
            h.insert(h.end(), meta.begin(), meta.end());
            h[0] = static_cast<std::uint8_t>(h.size());
        }
        int value = 0;
        if (faults_.take("corrupt_header", &value)) h[0] = static_cast<std::uint8_t>(value);
        if (faults_.take("error_bit")) h[1] |= 0x40;
        return h;
    }

    // `sent` bytes of the frame are out.
    void tell_middle(Stream& s, std::size_t sent) {
        if (s.middle_told || sent < s.image.size() / 2) return;
        s.middle_told = true;
        faults_.middle_of_frame();
    }

    int iso_in(Stream& s, std::uint8_t* out, int size) {
        if (!s.on || (s.pos == 0 && !begin_frame(s))) return kLater;
        const std::vector<std::uint8_t> h = header(s);
        if (size < static_cast<int>(h.size()) + 1) return kLater;
        const std::size_t n = std::min(static_cast<std::size_t>(size) - h.size(), s.image.size() - s.pos);
        std::memcpy(out, h.data(), h.size());
        std::memcpy(out + h.size(), &s.image[s.pos], n);
        s.pos += n;
        tell_middle(s, s.pos);
        if (s.pos == s.image.size()) {
            if (!faults_.take("no_end_of_frame")) out[1] |= 2;
            end_frame(s);
        }
        return static_cast<int>(h.size() + n);
    }

    int bulk_in(Stream& s, std::uint8_t* out, int size) {
        if (!s.on) return kLater;
        if (s.end_payload) {
            s.end_payload = false;
            return 0;
        }
        if (s.payload_pos == s.payload.size()) {
            if (s.pos == 0 && !begin_frame(s)) return kLater;
            s.payload = header(s);
            s.payload_pos = 0;
            const std::size_t most = max_payload(s),
                              room = most > s.payload.size() ? most - s.payload.size() : 1;
            const auto from = s.image.begin() + static_cast<std::ptrdiff_t>(s.pos);
            const std::size_t n = std::min(room, s.image.size() - s.pos);
            s.payload.insert(s.payload.end(), from, from + static_cast<std::ptrdiff_t>(n));
            s.pos += n;
            s.last = s.pos == s.image.size();
            if (s.last && !faults_.take("no_end_of_frame")) s.payload[1] |= 2;
        }
        const std::size_t n = std::min(static_cast<std::size_t>(size), s.payload.size() - s.payload_pos);
        std::memcpy(out, &s.payload[s.payload_pos], n);
        s.payload_pos += n;
        const std::size_t left = s.payload.size() - s.payload_pos;
        tell_middle(s, s.pos - std::min(s.pos, left));
        if (left > 0) return static_cast<int>(n);
        // A payload that fills the request and is less than the most it could be does not end by itself.
        s.end_payload = n == static_cast<std::size_t>(size) && s.payload.size() < max_payload(s);
        if (s.last) end_frame(s);
        return static_cast<int>(n);
    }

    UvcConfig config_;
    int payload_;
    D4xx d4xx_;
    const Picture& picture_;
    Faults& faults_;
    std::vector<Stream> streams_;
    std::vector<std::uint8_t> jpegs_[4][24];
};

}  // namespace
}  // namespace rig

int main(int argc, char** argv) {
    rig::Arguments arguments(argc, argv, rig::kUsage,
                             {"--id", "--fps", "--payload", "--calibration", "--absurd"}, {"--iso"});
    rig::UvcConfig config;
    config.bulk = !arguments.has("--iso");
    config.fps = arguments.fps();
    config.absurd = arguments.get("--absurd", "");
    arguments.id(&config.vendor, &config.product);
    rig::UvcCamera camera(config, arguments.number("--payload", 0), arguments.get("--calibration", "good"),
                          arguments.picture, arguments.faults);
    rig::VirtualBus bus(arguments.faults);
    bus.add(camera);
    return bus.run();
}
