// SPDX-License-Identifier: MIT
// rig_client: Burin's own capture, any back end by its URI, over emulated sensors. Compares every pixel with
// what the emulators send (pattern.h), and states with what a stage expects. One line on stdout; exit code 0
// only when all was as expected.
#include <fcntl.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "../emulators/d4xx.h"
#include "../emulators/ps_protocol.h"
#include "../pattern.h"
#include "api/capture_backends.h"
#include "capture/demosaic.h"
#include "capture/live_source.h"
#include "capture/monotonic.h"

namespace {

using namespace burin;

constexpr char kUsage[] =
    "rig_client list                  devices of all back ends, one a line\n"
    "rig_client URI FRAMES [OPTION]   streams and compares each image with the pattern\n"
    "    --streams A,B        of depth colour infrared infrared_right confidence; default depth\n"
    "    --depth-format F     --colour-format F    by the names in StreamInfo::format\n"
    "    --size WxH           --colour-size WxH    --fps N\n"
    "    --damaged N          at most N images may be lost or damaged; default 0\n"
    "    --damaged-at-least N  and at least so many must be\n"
    "    --reconnects N       so many times it must have come back by itself, each within two seconds\n"
    "    --restarts N         so many times it must have been started again\n"
    "    --fails CODE         opening, starting or streaming has to fail with this code (timeout, format, "
    "...)\n"
    "    --imu N              at least N samples, all of --imu-is X,Y,Z (m/s2, within 0.01)\n"
    "    --cycles N           opens, streams FRAMES and closes N times, and looks at memory\n"
    "    --fd PATH            hands over an open descriptor of PATH instead of letting the back end open it\n"
    "    --uid N              as this user\n"
    "    --timeout S          for one frame; default 10\n"
    "    --plain              no pattern in it\n"
    "    --layout             images are four below one another: infrared, depth, nothing, confidence\n"
    "    --d4xx               intrinsics and extrinsic are those of the emulated D4xx's tables\n"
    "    --nominal            no stream is calibrated\n"
    "    --log                log lines of the source on stderr\n";

struct Wanted {
    std::string uri, fails, fd_path;
    LiveOptions options;
    int frames = 0, cycles = 1, imu = 0;
    long damaged = 0, damaged_at_least = 0, reconnects = 0, restarts = 0;
    double timeout_s = 10, imu_is[3] = {};
    bool plain = false, compare_imu = false, log = false, d4xx = false, nominal = false, layout = false;
};

const char* code_name(Code code) {
    switch (code) {
        case Code::ok:
            return "ok";
        case Code::invalid_argument:
            return "invalid_argument";
        case Code::insufficient_memory:
            return "insufficient_memory";
        case Code::io:
            return "io";
        case Code::format:
            return "format";
        case Code::state:
            return "state";
        case Code::unsupported:
            return "unsupported";
        case Code::cancelled:
            return "cancelled";
        case Code::timeout:
            return "timeout";
        case Code::disconnected:
            return "disconnected";
        case Code::busy:
            return "busy";
        case Code::denied:
            return "denied";
        case Code::ended:
            return "ended";
    }
    return "?";
}

// Where the pattern is, of an image as the back end hands it out.
struct Comparison {
    rig::Format format;                // of the samples
    std::vector<std::uint16_t> depth;  // of readings, when images hold their depths
    bool swapped = false;              // bytes of each pair have changed places (UYVY as YUYV)
    bool mosaic = false;               // the image is RGB out of a mosaic
    bool yuv = false, jpeg = false;    // the image is RGB out of these
    int step = 1, phase = 0;           // every so manieth sample, from this one on: one image of two
    int first_row = 0;                 // behind another plane
    bool part = false;                 // one of several below one another
    bool known = false;
};

// With --layout: four images below one another, as LAYOUT says.
constexpr const char* kLayout =
    "images=4 take=1 brightness=0 confidence=3 certain=8000 mask=0xffff scale=1 offset=0 none=65536 "
    "unit=0.001";

Comparison comparison_of(const StreamInfo& s, bool parts) {
    Comparison c;
    if (parts) {
        c.format = {rig::Layout::u16, 16, s.width, s.height};
        c.first_row = (s.kind == StreamKind::depth ? 1 : s.kind == StreamKind::infrared ? 0 : 3) * s.height;
        c.part = c.known = true;
        return c;
    }
    const std::string name = s.format;
    const auto samples = [&](rig::Layout layout, int bits, int columns) {
        c.format = {layout, bits, columns, s.height};
        c.known = true;
    };
    if (name.rfind("packed", 0) == 0 || name == "shift16" || name == "ps-depth") {
        samples(rig::Layout::u16, name == "packed10" ? 10 : 11, s.width);
        if (s.kind == StreamKind::depth) {
            c.depth.assign(2048, 0);
            for (int r = 0; r < 2047; ++r)
                c.depth[static_cast<std::size_t>(r)] =
                    static_cast<std::uint16_t>(rig::ps_depth_mm(rig::PsConstants(), r));
        }
    } else if (name == "UYVY" || name == "YUYV" || name == "ps-yuv") {
        samples(rig::Layout::u8, 8, 2 * s.width);
        c.swapped = name != "YUYV";
        c.yuv = s.colour_format == PixelFormat::rgb8;
        c.swapped = c.swapped && !c.yuv;
    } else if (name == "MJPG") {
        samples(rig::Layout::u8, 8, s.width);
        c.jpeg = true;
    } else if (name == "GRBG" || name == "ps-GRBG" || name == "GRBG8") {
        samples(rig::Layout::u8, 8, s.width);
        c.mosaic = true;
    } else if (name == "Y8I" || name == "Y12I") {
        samples(rig::Layout::u16, name == "Y8I" ? 8 : 12, s.width);
        c.step = 2;
        c.phase = s.kind == StreamKind::infrared_right;
    } else if (name == "INZI" && s.kind == StreamKind::depth) {
        samples(rig::Layout::u16, 16, s.width);
        c.first_row = s.height;
    } else if (s.pixels == StreamPixels::u8) {
        samples(rig::Layout::u8, 8, s.width);
    } else if (s.pixels == StreamPixels::u16) {
        const int bits = name.rfind("Y10", 0) == 0 || name == "RW10" || name == "pRAA" || name == "INZI" ? 10
                         : name.rfind("Y12", 0) == 0                                                     ? 12
                                                                                                         : 16;
        samples(rig::Layout::u16, bits, s.width);
    }
    return c;
}

std::uint16_t word(const CapturedImage& image, int x, int y) {
    std::uint16_t v;
    std::memcpy(
        &v, image.pixels + static_cast<std::size_t>(y) * image.stride_bytes + 2 * static_cast<std::size_t>(x),
        2);
    return v;
}

// Of RGB images: those of `expected`(n), an image of frame n, that are off by more than `allowed`; n is the
// one whose first rows fit best.
template <class Expected>
std::size_t rgb_mismatches(const StreamInfo& s, const CapturedImage& image, int frames, int allowed,
                           Expected&& expected) {
    const auto wrong = [&](int n, int rows) {
        const std::vector<std::uint8_t> rgb = expected(n);
        std::size_t count = 0;
        for (int y = 0; y < rows; ++y)
            for (int i = 0; i < 3 * s.width; ++i)
                count +=
                    std::abs(image.pixels[static_cast<std::size_t>(y) * image.stride_bytes +
                                          static_cast<std::size_t>(i)] -
                             rgb[static_cast<std::size_t>(y) * 3 * s.width + static_cast<std::size_t>(i)]) >
                    allowed;
        return count;
    };
    int best = 0;
    std::size_t least = SIZE_MAX;
    for (int n = 0; n < frames && least > 0; ++n)
        if (const std::size_t count = wrong(n, 1); count < least) best = n, least = count;
    return wrong(best, s.height);
}

std::vector<std::uint8_t> uyvy_as_rgb(const StreamInfo& s, const rig::Format& format, int n) {
    std::vector<std::uint8_t> raw(rig::format_bytes(format)),
        rgb(static_cast<std::size_t>(3) * s.width * s.height);
    rig::pattern_fill(format, static_cast<std::uint32_t>(n), raw.data());
    simd::scalar::yuv422_to_rgb(simd::Yuv422::uyvy, raw.data(), raw.size(), s.width * s.height, rgb.data());
    return rgb;
}

std::vector<std::uint8_t> jpeg_as_rgb(const StreamInfo& s, int n) {
    std::vector<std::uint8_t> rgb;
    for (int y = 0; y < s.height; ++y)
        for (int x = 0; x < s.width; ++x)
            rgb.insert(rgb.end(), 3,
                       rig::pattern_jpeg_grey(static_cast<std::uint32_t>(n), static_cast<std::uint32_t>(x),
                                              static_cast<std::uint32_t>(y)));
    return rgb;
}

// One of the images that lie in one another or behind each other.
std::size_t part_mismatches(const StreamInfo& s, const Comparison& c, const CapturedImage& image) {
    const auto sample = [&](int x, int y) -> std::uint32_t {
        if (s.pixels == StreamPixels::u16) return word(image, x, y);
        return image.pixels[static_cast<std::size_t>(y) * image.stride_bytes + static_cast<std::size_t>(x)];
    };
    const auto offset = [&](int x, int y) {
        return rig::pattern_offset(static_cast<std::uint32_t>(c.step * x + c.phase),
                                   static_cast<std::uint32_t>(c.first_row + y));
    };
    const std::uint32_t mask = (1u << c.format.bits) - 1;
    const bool confidence = s.kind == StreamKind::confidence;
    const auto wrong_of = [&](std::uint32_t n, int rows) {
        std::size_t wrong = 0;
        for (int y = 0; y < rows; ++y)
            for (int x = 0; x < s.width; ++x) {
                const std::uint32_t v = (n + offset(x, y)) & mask;
                wrong += sample(x, y) != (confidence ? std::min(v, 8000u) * 255 / 8000 : v);
            }
        return wrong;
    };
    // A byte of confidence does not tell which frame it is, a row does.
    std::uint32_t n = confidence ? 0 : sample(0, 0) - offset(0, 0);
    while (confidence && n < 1000 && wrong_of(n, 1) > 0) ++n;
    return wrong_of(n, s.height);
}

// Samples that differ from the pattern of the frame that fits best.
std::size_t mismatches(const StreamInfo& s, const Comparison& c, const CapturedImage& image) {
    const std::uint32_t mask = (1u << c.format.bits) - 1;
    if (c.yuv) return rgb_mismatches(s, image, 256, 0, [&](int n) { return uyvy_as_rgb(s, c.format, n); });
    if (c.jpeg) return rgb_mismatches(s, image, 24, 4, [&](int n) { return jpeg_as_rgb(s, n); });
    if (c.part || c.step > 1 || c.first_row > 0) return part_mismatches(s, c, image);
    if (c.mosaic) {
        const std::uint32_t n = image.pixels[1];  // the first pixel is green
        std::vector<std::uint8_t> raw(static_cast<std::size_t>(s.width) * s.height), rgb(3 * raw.size());
        rig::pattern_fill(c.format, n, raw.data());
        static auto demosaic = std::make_unique<Demosaic>();
        demosaic->run({BayerOrder::grbg, simd::Packing::u8, 8}, {raw.data(), raw.size(), 0},
                      View<std::uint8_t>{rgb.data(), s.width, s.height, 3 * s.width, 3});
        std::size_t wrong = 0;
        for (int y = 0; y < s.height; ++y)
            for (int i = 0; i < 3 * s.width; ++i)
                wrong += image.pixels[static_cast<std::size_t>(y) * image.stride_bytes +
                                      static_cast<std::size_t>(i)] !=
                         rgb[static_cast<std::size_t>(y) * 3 * s.width + static_cast<std::size_t>(i)];
        return wrong;
    }
    if (c.swapped) {
        std::vector<std::uint8_t> bytes(rig::format_bytes(c.format));
        for (int y = 0; y < c.format.rows; ++y)
            for (int i = 0; i < c.format.columns; ++i)
                bytes[static_cast<std::size_t>(y) * c.format.columns + (static_cast<std::size_t>(i) ^ 1)] =
                    image.pixels[static_cast<std::size_t>(y) * image.stride_bytes +
                                 static_cast<std::size_t>(i)];
        std::uint32_t n = 0;
        return rig::pattern_mismatches(c.format, bytes.data(), &n);
    }
    if (c.depth.empty()) {
        std::uint32_t n = 0;
        return rig::pattern_mismatches(c.format, image.pixels, &n, image.stride_bytes);
    }
    const auto expected = [&](std::uint32_t n, int x, int y) {
        return c.depth[rig::pattern(n, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)) & mask];
    };
    // One pixel does not tell which frame it is, a row does.
    std::uint32_t n = 0;
    for (; n < mask; ++n) {
        bool same = true;
        for (int x = 0; x < std::min(s.width, 160) && same; ++x)
            same = word(image, x, 0) == expected(n, x, 0);
        if (same) break;
    }
    std::size_t wrong = 0;
    for (int y = 0; y < s.height; ++y)
        for (int x = 0; x < s.width; ++x) wrong += word(image, x, y) != expected(n, x, y);
    return wrong;
}

int list() {
    int devices = 0;
    for (int b = 0; b < capture_backend_count(); ++b) {
        const SourceBackend& backend = capture_backend(b);
        struct Seen {
            const SourceBackend* backend;
            int* devices;
        } seen = {&backend, &devices};
        const Status s = backend.list(
            [](void* user, const DeviceEntry& e) {
                const auto* x = static_cast<Seen*>(user);
                ++*x->devices;
                std::printf("%s:%s | %s | serial %s | %s | driver %s | %s | access %d | %s\n",
                            x->backend->name, e.address, e.name, e.serial, e.location, e.driver, e.formats,
                            static_cast<int>(e.access), e.hint);
            },
            &seen);
        if (!s.ok()) std::printf("%s: %s\n", backend.name, s.text());
    }
    std::printf("%d devices\n", devices);
    return 0;
}

bool near(double a, double b) { return std::abs(a - b) < 1e-3; }

// What the device says of its cameras arrived.
bool d4xx_is_true(const DeviceInfo& info) {
    const rig::D4xxTruth t;
    const StreamInfo &depth = info.at(StreamKind::depth), &colour = info.at(StreamKind::colour);
    const Camera &d = depth.camera, &c = colour.camera;
    const double k = depth.height / 480.0;
    return depth.calibrated && colour.calibrated && near(d.fx, t.fx * k) && near(d.fy, t.fy * k) &&
           near(d.cx, t.cx * k) && near(d.cy, t.cy * k) && near(c.fx, t.colour_fx) &&
           near(c.fy, t.colour_fy) && near(c.cx, t.colour_cx) && near(c.cy, t.colour_cy) &&
           near(colour.T_stream_depth.t.x, t.colour_t_mm[0] * 1e-3) &&
           near(colour.T_stream_depth.t.y, t.colour_t_mm[1] * 1e-3) &&
           near(colour.T_stream_depth.t.z, t.colour_t_mm[2] * 1e-3);
}

bool all_nominal(const DeviceInfo& info) {
    for (const StreamInfo& s : info.streams)
        if (s.calibrated) return false;
    return true;
}

int failed(const Wanted& w, const Status& s, const char* where) {
    const bool expected = w.fails == code_name(s.code());
    std::printf("%s%s: %s: %s\n", expected ? "" : "unexpected ", where, code_name(s.code()), s.text());
    return expected ? 0 : 1;
}

struct Totals {
    std::size_t frames = 0, wrong = 0, imu = 0, imu_wrong = 0, images[kStreamKinds] = {}, unknown = 0;
    double longest_wait_s = 0;
};

// -1: go on.
int run_once(const Wanted& w, const SourceBackend& backend, const char* address, Totals* totals,
             SourceStatistics* statistics) {
    LiveSource source;
    LiveOptions options = w.options;
    int fd = -1;
    if (!w.fd_path.empty()) {
        fd = ::open(w.fd_path.c_str(), O_RDWR | O_CLOEXEC);
        if (fd < 0) return std::printf("cannot open %s\n", w.fd_path.c_str()), 1;
        options.device.fd = fd;
    }
    struct Closer {
        int fd;
        ~Closer() {
            if (fd >= 0) ::close(fd);
        }
    } closer = {fd};
    Status s = source.open(backend, address, options);
    if (!s.ok()) return failed(w, s, "open");
    if (w.d4xx && !d4xx_is_true(source.info())) return std::printf("not the calibration of the device\n"), 1;
    if (w.nominal && !all_nominal(source.info())) return std::printf("calibrated, by nonsense\n"), 1;
    s = source.start();
    if (!s.ok()) return failed(w, s, "start");
    Comparison comparisons[kStreamKinds];
    for (int k = 0; k < kStreamKinds; ++k) comparisons[k] = comparison_of(source.info().streams[k], w.layout);
    for (int n = 0; n < w.frames;) {
        CapturedFrame frame;
        const std::int64_t asked_ns = monotonic_ns();
        do s = source.next(100'000'000, &frame);
        while ((s.code() == Code::timeout || s.code() == Code::disconnected) &&
               monotonic_ns() - asked_ns < w.timeout_s * 1e9 && source.state() != SourceState::failed);
        totals->longest_wait_s =
            std::max(totals->longest_wait_s, static_cast<double>(monotonic_ns() - asked_ns) * 1e-9);
        if (!s.ok()) return failed(w, s, "streaming");
        ++n;
        ++totals->frames;
        for (int i = 0; i < frame.imu_count; ++i) {
            const Vec3d a = frame.imu[i].accel_m_s2;
            ++totals->imu;
            totals->imu_wrong +=
                w.compare_imu && !(std::abs(a.x - w.imu_is[0]) < 0.01 && std::abs(a.y - w.imu_is[1]) < 0.01 &&
                                   std::abs(a.z - w.imu_is[2]) < 0.01);
        }
        for (int k = 0; k < kStreamKinds; ++k) {
            const auto kind = static_cast<StreamKind>(k);
            if (!frame.has(kind)) continue;
            ++totals->images[k];
            if (w.plain) continue;
            if (!comparisons[k].known) {
                ++totals->unknown;
                continue;
            }
            totals->wrong += mismatches(source.info().at(kind), comparisons[k], frame.at(kind));
        }
    }
    *statistics = source.statistics();
    s = source.stop();
    if (!s.ok()) return failed(w, s, "stop");
    source.close();
    return -1;
}

int run(const Wanted& w) {
    const char* address = nullptr;
    const SourceBackend* backend = find_capture_backend(w.uri.c_str(), &address);
    if (!backend) return std::printf("no back end for %s\n", w.uri.c_str()), 1;
    Totals totals;
    SourceStatistics statistics;
    long lost = 0, damaged = 0;
    std::size_t after_first = 0;
    const int files_before = ::dup(0);
    ::close(files_before);
    for (int cycle = 0; cycle < w.cycles; ++cycle) {
        const int code = run_once(w, *backend, address, &totals, &statistics);
        if (code >= 0) return code;
        for (const StreamStatistics& s : statistics.streams)
            lost += static_cast<long>(s.lost), damaged += static_cast<long>(s.damaged);
        if (cycle == std::min(10, w.cycles - 1)) after_first = mallinfo2().uordblks;
    }
    const int files_after = ::dup(0);
    ::close(files_after);
    const long grown = static_cast<long>(mallinfo2().uordblks) - static_cast<long>(after_first);
    std::string images;
    for (int k = 0; k < kStreamKinds; ++k)
        if (w.options.device.streams & 1u << k)
            images += std::string(" ") + stream_name(static_cast<StreamKind>(k)) + " " +
                      std::to_string(totals.images[k]) + " of " +
                      std::to_string(statistics.streams[k].captured);
    std::printf(
        "%zu frames,%s, wrong samples %zu, lost %ld, damaged %ld, reconnects %llu, restarts %llu, imu %zu, "
        "longest wait %.2f s, "
        "wait p50 %.2f ms",
        totals.frames, images.c_str(), totals.wrong, lost, damaged,
        static_cast<unsigned long long>(statistics.reconnects),
        static_cast<unsigned long long>(statistics.restarts), totals.imu, totals.longest_wait_s,
        statistics.wait_p50_ms);
    if (w.cycles > 1)
        std::printf(", %d cycles, memory %+ld bytes, descriptors %+d", w.cycles, grown,
                    files_after - files_before);
    const auto wrong = [](const char* what) { return std::printf("; wrong: %s\n", what), 1; };
    if (!w.fails.empty()) return wrong("it did not fail");
    if (totals.wrong > 0) return wrong("pixels");
    if (totals.unknown > 0) return wrong("no pattern is known for a format");
    // Under emulation, images of two streams are seldom near enough in time to be one frame.
    for (int k = 0; k < kStreamKinds && w.frames > 0; ++k)
        if ((w.options.device.streams & 1u << k) && statistics.streams[k].captured == 0)
            return wrong("a stream without images");
    if (lost + damaged > w.damaged) return wrong("too much is damaged");
    if (lost + damaged < w.damaged_at_least) return wrong("too little is damaged");
    if (static_cast<long>(statistics.reconnects) != w.reconnects) return wrong("reconnects");
    if (static_cast<long>(statistics.restarts) < w.restarts) return wrong("restarts");
    if (totals.imu < static_cast<std::size_t>(w.imu)) return wrong("too few samples of the IMU");
    if (totals.imu_wrong > 0) return wrong("samples of the IMU");
    if (w.cycles > 1 && (grown > 256 * 1024 || files_after != files_before)) return wrong("something leaks");
    std::puts("");
    return 0;
}

void log_line(void*, LogLevel level, const char* line) {
    std::fprintf(stderr, "%s: %s\n",
                 level == LogLevel::error     ? "error"
                 : level == LogLevel::warning ? "warning"
                                              : "info",
                 line);
}

bool parse_size(const char* text, int* width, int* height) {
    return std::sscanf(text, "%dx%d", width, height) == 2;
}

bool parse(int argc, char** argv, Wanted* w) {
    if (argc < 3) return false;
    w->uri = argv[1];
    w->frames = std::atoi(argv[2]);
    SourceOptions& o = w->options.device;
    o.streams = stream_bit(StreamKind::depth);
    for (int i = 3; i < argc; ++i) {
        const std::string a = argv[i];
        if (a == "--plain") {
            w->plain = true;
            continue;
        }
        if (a == "--d4xx" || a == "--nominal") {
            (a == "--d4xx" ? w->d4xx : w->nominal) = true;
            continue;
        }
        if (a == "--layout") {
            w->layout = true;
            std::snprintf(w->options.device.layout, sizeof w->options.device.layout, "%s", kLayout);
            continue;
        }
        if (a == "--log") {
            w->options.log = log_line;
            continue;
        }
        if (++i >= argc) return false;
        const char* v = argv[i];
        if (a == "--streams") {
            o.streams = 0;
            for (int k = 0; k < kStreamKinds; ++k)
                for (const char* at = v; at; at = std::strchr(at, ','), at = at ? at + 1 : nullptr) {
                    const char* name = stream_name(static_cast<StreamKind>(k));
                    const std::size_t n = std::strcspn(at, ",");
                    if (std::strlen(name) == n && std::strncmp(at, name, n) == 0) o.streams |= 1u << k;
                }
        } else if (a == "--depth-format") {
            std::snprintf(o.depth_format, sizeof o.depth_format, "%s", v);
        } else if (a == "--colour-format") {
            std::snprintf(o.colour_format, sizeof o.colour_format, "%s", v);
        } else if (a == "--size") {
            if (!parse_size(v, &o.depth_width, &o.depth_height)) return false;
        } else if (a == "--colour-size") {
            if (!parse_size(v, &o.colour_width, &o.colour_height)) return false;
        } else if (a == "--fps") {
            o.fps = std::atof(v);
        } else if (a == "--damaged") {
            w->damaged = std::atol(v);
        } else if (a == "--damaged-at-least") {
            w->damaged_at_least = std::atol(v);
        } else if (a == "--reconnects") {
            w->reconnects = std::atol(v);
        } else if (a == "--restarts") {
            w->restarts = std::atol(v);
        } else if (a == "--fails") {
            w->fails = v;
        } else if (a == "--imu") {
            w->imu = std::atoi(v);
        } else if (a == "--imu-is") {
            w->compare_imu = true;
            if (std::sscanf(v, "%lf,%lf,%lf", &w->imu_is[0], &w->imu_is[1], &w->imu_is[2]) != 3) return false;
        } else if (a == "--cycles") {
            w->cycles = std::max(1, std::atoi(v));
        } else if (a == "--fd") {
            w->fd_path = v;
        } else if (a == "--uid") {
            if (::setuid(static_cast<uid_t>(std::atoi(v))) != 0) return false;
        } else if (a == "--timeout") {
            w->timeout_s = std::atof(v);
        } else {
            return false;
        }
    }
    return o.streams != 0;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc == 2 && std::strcmp(argv[1], "list") == 0) return list();
    Wanted wanted;
    if (!parse(argc, argv, &wanted)) return std::fputs(kUsage, stderr), 2;
    return run(wanted);
}
