// SPDX-License-Identifier: MIT
// rig_v4l: a small V4L2 client that shares nothing with Burin's own. It checks the emulators through the
// kernel's drivers, and sets what a stage needs set. One line on stdout; exit code 0 only when all was as
// expected.
#include <fcntl.h>
#include <linux/usb/video.h>
#include <linux/uvcvideo.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <vector>

#include "../emulators/picture.h"
#include "../pattern.h"

namespace {

constexpr char kUsage[] =
    "rig_v4l NODE list                              formats and sizes\n"
    "rig_v4l NODE grab FOURCC[-BE] W H FRAMES [OPTION]   streams by mmap and compares each frame with the "
    "pattern\n"
    "    --plain       no pattern in it: sizes and sequence only\n"
    "    --frames FILE rendered frames instead of the pattern (Z16): each is one of the file's, in their "
    "order\n"
    "    --damaged N   at most N frames may be flagged, short or out of sequence\n"
    "    --flagged-at-least N   --gaps-at-least N   so many must be\n"
    "    --timeout S   for one frame; default 10\n"
    "    --until-gone  runs until the device goes, and expects ENODEV\n"
    "    --save FILE   keeps the last frame\n"
    "rig_v4l NODE meta FOURCC FRAMES DEPTH_NODE     metadata buffers beside Z16 640x480: frame counter and "
    "time rise\n"
    "rig_v4l NODE set CONTROL VALUE                 a control by its name\n"
    "rig_v4l NODE xu SELECTOR [HEX...]              extension unit 3: reads it, or writes these bytes first "
    "and reads then\n";

int fail(const char* what) { return std::printf("%s: %s\n", what, std::strerror(errno)), 1; }

int control(int fd, unsigned long request, void* argument) {
    int r = 0;
    do r = ioctl(fd, request, argument);
    while (r < 0 && errno == EINTR);
    return r;
}

bool pixels_of(const std::string& code, int w, int h, rig::Format* f) {
    using rig::Layout;
    const struct {
        const char* code;
        Layout layout;
        int bits, samples, planes;
    } known[] = {{"Z16 ", Layout::u16, 16, 1, 1},    {"Y16 ", Layout::u16, 16, 1, 1},
                 {"Y10 ", Layout::u16, 10, 1, 1},    {"Y12 ", Layout::u16, 12, 1, 1},
                 {"INZI", Layout::inzi, 16, 1, 2},   {"GREY", Layout::u8, 8, 1, 1},
                 {"Y8I ", Layout::u8, 8, 2, 1},      {"Y12I", Layout::pair12, 12, 2, 1},
                 {"pRAA", Layout::mipi10, 10, 1, 1}, {"YUYV", Layout::u8, 8, 2, 1},
                 {"UYVY", Layout::u8, 8, 2, 1},      {"GRBG", Layout::u8, 8, 1, 1},
                 {"Y10B", Layout::packed, 10, 1, 1}};
    for (const auto& k : known) {
        if (code != k.code) continue;
        *f = {k.layout, k.bits, w * k.samples, h * k.planes};
        return true;
    }
    return false;
}

struct Mapped {
    std::uint8_t* data = nullptr;
    std::size_t size = 0;
};

// Pixels that differ from the recorded frame nearest after *at that has fewest; *at becomes its number.
long picture_mismatches(const rig::Picture& picture, const std::uint8_t* data, int width, int height,
                        int* at) {
    long least = static_cast<long>(width) * height + 1;
    int best = *at;
    for (int n = std::max(0, *at); n < picture.frames() && least > 0; ++n) {
        long wrong = 0;
        for (int i = 0; i < width * height && wrong < least; ++i) {
            const std::uint8_t* p = data + 2 * static_cast<std::ptrdiff_t>(i);
            wrong +=
                (p[0] | p[1] << 8) != picture.depth_mm(static_cast<std::uint32_t>(n), i % width, i / width)
                    ? 1
                    : 0;
        }
        if (wrong < least) least = wrong, best = n;
    }
    *at = best;
    return least;
}

struct Streaming {
    int fd;
    int type;
    std::vector<Mapped> buffers;
    bool begin(int count) {
        v4l2_requestbuffers request{};
        request.count = static_cast<unsigned>(count);
        request.type = static_cast<unsigned>(type);
        request.memory = V4L2_MEMORY_MMAP;
        if (control(fd, VIDIOC_REQBUFS, &request) != 0) return fail("REQBUFS"), false;
        for (unsigned i = 0; i < request.count; ++i) {
            v4l2_buffer b{};
            b.index = i;
            b.type = static_cast<unsigned>(type);
            b.memory = V4L2_MEMORY_MMAP;
            if (control(fd, VIDIOC_QUERYBUF, &b) != 0) return fail("QUERYBUF"), false;
            void* p = mmap(nullptr, b.length, PROT_READ, MAP_SHARED, fd, b.m.offset);
            if (p == MAP_FAILED) return fail("mmap"), false;
            buffers.push_back({static_cast<std::uint8_t*>(p), b.length});
            if (control(fd, VIDIOC_QBUF, &b) != 0) return fail("QBUF"), false;
        }
        if (control(fd, VIDIOC_STREAMON, &type) != 0) return fail("STREAMON"), false;
        return true;
    }
    int timeout_s = 10;
    // 1 a buffer, 0 nothing within the timeout, -1 an error in errno
    int next(v4l2_buffer* b) {
        for (;;) {
            pollfd p = {fd, POLLIN, 0};
            if (poll(&p, 1, 1000 * timeout_s) == 0) return 0;
            *b = {};
            b->type = static_cast<unsigned>(type);
            b->memory = V4L2_MEMORY_MMAP;
            if (control(fd, VIDIOC_DQBUF, b) == 0) return 1;
            if (errno != EAGAIN) return -1;
        }
    }
};

int list(int fd, int type) {
    for (unsigned i = 0;; ++i) {
        v4l2_fmtdesc d{};
        d.index = i;
        d.type = static_cast<unsigned>(type);
        if (control(fd, VIDIOC_ENUM_FMT, &d) != 0) break;
        std::printf("%.4s", reinterpret_cast<const char*>(&d.pixelformat));
        for (unsigned k = 0;; ++k) {
            v4l2_frmsizeenum s{};
            s.index = k;
            s.pixel_format = d.pixelformat;
            if (control(fd, VIDIOC_ENUM_FRAMESIZES, &s) != 0 || s.type != V4L2_FRMSIZE_TYPE_DISCRETE) break;
            std::printf(" %ux%u", s.discrete.width, s.discrete.height);
        }
        std::printf("; ");
    }
    std::printf("\n");
    return 0;
}

struct GrabOptions {
    std::string code, save;
    int width = 0, height = 0, frames = 0, damaged = 0, least_flagged = 0, least_gaps = 0, timeout_s = 10;
    const rig::Picture* picture = nullptr;
    bool plain = false, until_gone = false, big_endian = false;
};

int grab(int fd, int type, const GrabOptions& o) {
    v4l2_format format{};
    format.type = static_cast<unsigned>(type);
    const unsigned big_endian = o.big_endian ? 1u << 31 : 0;
    format.fmt.pix.width = static_cast<unsigned>(o.width);
    format.fmt.pix.height = static_cast<unsigned>(o.height);
    std::memcpy(&format.fmt.pix.pixelformat, o.code.c_str(), 4);
    format.fmt.pix.pixelformat |= big_endian;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    if (control(fd, VIDIOC_S_FMT, &format) != 0) return fail("S_FMT");
    format.fmt.pix.pixelformat ^= big_endian;
    if (std::memcmp(&format.fmt.pix.pixelformat, o.code.c_str(), 4) != 0 ||
        static_cast<int>(format.fmt.pix.width) != o.width ||
        static_cast<int>(format.fmt.pix.height) != o.height)
        return std::printf("the driver gives %.4s %ux%u\n",
                           reinterpret_cast<const char*>(&format.fmt.pix.pixelformat), format.fmt.pix.width,
                           format.fmt.pix.height),
               1;
    v4l2_streamparm rate{};  // as fast as it goes
    rate.type = static_cast<unsigned>(type);
    rate.parm.capture.timeperframe = {1, 60};
    control(fd, VIDIOC_S_PARM, &rate);
    rig::Format pixels;
    const bool jpeg = o.code == "MJPG";
    const bool known = pixels_of(o.code, o.width, o.height, &pixels);
    if (!known && !jpeg && !o.plain) return std::printf("no pattern for %s\n", o.code.c_str()), 1;
    Streaming stream{fd, type, {}};
    stream.timeout_s = o.timeout_s;
    if (!stream.begin(4)) return 1;
    int got = 0, whole = 0, gaps = 0, flagged = 0, shorts = 0;
    long wrong = 0;
    unsigned last = 0;
    int recorded = 0;
    timespec t0{}, t1{};
    clock_gettime(CLOCK_MONOTONIC, &t0);
    while (whole < o.frames && got < 20 * o.frames + 100) {
        v4l2_buffer b;
        const int r = stream.next(&b);
        if (r == 0) return std::printf("no frame for %d s after %d\n", o.timeout_s, got), 1;
        if (r < 0 && o.until_gone && errno == ENODEV)
            return std::printf("ENODEV after %d frames, %d gaps, %d flagged\n", got, gaps, flagged), 0;
        if (r < 0) return fail("DQBUF");
        const Mapped& m = stream.buffers[b.index];
        if (got > 0)
            gaps += std::max(0, static_cast<int>(b.sequence - last - 1));  // vivid counts one twice at times
        last = b.sequence;
        ++got;
        const std::size_t want = jpeg ? 4 : o.plain ? format.fmt.pix.sizeimage : rig::format_bytes(pixels);
        if ((b.flags & V4L2_BUF_FLAG_ERROR) != 0)
            ++flagged;
        else if (b.bytesused < want)
            ++shorts;
        else {
            ++whole;
            std::uint32_t number = 0;
            if (jpeg)
                wrong += m.data[0] != 0xff || m.data[1] != 0xd8;
            else if (o.picture != nullptr)
                wrong += picture_mismatches(*o.picture, m.data, o.width, o.height, &recorded);
            else if (!o.plain)
                wrong += static_cast<long>(rig::pattern_mismatches(pixels, m.data, &number));
            if (!o.save.empty() && whole == o.frames) {
                FILE* f = std::fopen(o.save.c_str(), "wb");
                if (f == nullptr || std::fwrite(m.data, 1, b.bytesused, f) != b.bytesused ||
                    std::fclose(f) != 0)
                    return fail(o.save.c_str());
            }
        }
        if (control(fd, VIDIOC_QBUF, &b) != 0 && !(o.until_gone && errno == ENODEV)) return fail("QBUF");
    }
    clock_gettime(CLOCK_MONOTONIC, &t1);
    control(fd, VIDIOC_STREAMOFF, &type);
    const double s =
        static_cast<double>(t1.tv_sec - t0.tv_sec) + 1e-9 * static_cast<double>(t1.tv_nsec - t0.tv_nsec);
    std::printf("%d frames %s %dx%d in %.2f s, %ld wrong pixels, %d gaps, %d flagged, %d short\n", whole,
                o.code.c_str(), o.width, o.height, s, wrong, gaps, flagged, shorts);
    // Gaps are no fault of the emulator: an emulated processor may be late. Whatever comes must be right.
    return wrong == 0 && whole == o.frames && flagged + shorts <= o.damaged && flagged >= o.least_flagged &&
                   gaps >= o.least_gaps && !o.until_gone
               ? 0
               : 1;
}

int metadata(int fd, const std::string& code, int frames, const char* depth_node) {
    // The kernel takes no other metadata format once the depth node has buffers, and sends none before that
    // node streams.
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_META_CAPTURE;
    if (control(fd, VIDIOC_G_FMT, &format) != 0) return fail("G_FMT");
    std::memcpy(&format.fmt.meta.dataformat, code.c_str(), 4);
    if (control(fd, VIDIOC_S_FMT, &format) != 0) return fail("S_FMT");
    if (std::memcmp(&format.fmt.meta.dataformat, code.c_str(), 4) != 0)
        return std::printf("the driver does not know metadata %s\n", code.c_str()), 1;
    const int depth_fd = open(depth_node, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    v4l2_format pixels{};
    pixels.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    pixels.fmt.pix.width = 640;
    pixels.fmt.pix.height = 480;
    pixels.fmt.pix.pixelformat = V4L2_PIX_FMT_Z16;
    if (depth_fd < 0 || control(depth_fd, VIDIOC_S_FMT, &pixels) != 0) return fail(depth_node);
    Streaming stream{fd, V4L2_BUF_TYPE_META_CAPTURE, {}}, depth{depth_fd, V4L2_BUF_TYPE_VIDEO_CAPTURE, {}};
    if (!stream.begin(4) || !depth.begin(4)) return 1;
    std::uint32_t pts = 0, counter = 0;
    int rising = 0, counted = 0, laser = -1;
    for (int i = 0; i < frames; ++i) {
        v4l2_buffer b;
        if (depth.next(&b) != 1 || control(depth_fd, VIDIOC_QBUF, &b) != 0)
            return std::printf("no frame after %d\n", i), 1;
        if (stream.next(&b) != 1) return std::printf("no metadata after %d\n", i), 1;
        // Per payload: u64 time in ns, u16 frame number of the host, u8 length and u8 flags of the header,
        // then the rest of it.
        const std::uint8_t* p = stream.buffers[b.index].data;
        std::uint32_t now = 0;
        if (b.bytesused >= 22 && p[10] >= 12) {
            std::memcpy(&now, p + 12, 4);
            if (i == 0 || now > pts) ++rising;
            pts = now;
        }
        // D4XX: depth control follows the standard header, capture timing 60 bytes on.
        if (code == "D4XX" && b.bytesused >= 22u + 60 + 20) {
            std::uint32_t id = 0, n = 0;
            std::memcpy(&laser, p + 22 + 24, 4);
            std::memcpy(&id, p + 22 + 60, 4);
            std::memcpy(&n, p + 22 + 60 + 16, 4);
            if (id == 0x80000001u && (i == 0 || n > counter)) ++counted;
            counter = n;
        }
        if (control(fd, VIDIOC_QBUF, &b) != 0) return fail("QBUF");
    }
    std::printf("%d metadata buffers, %d with rising PTS, %d with rising frame counter, laser power %d\n",
                frames, rising, counted, laser);
    return rising == frames && (code != "D4XX" || counted == frames) ? 0 : 1;
}

int set_control(int fd, const char* name, int value) {
    v4l2_queryctrl q{};
    q.id = V4L2_CTRL_FLAG_NEXT_CTRL;
    for (; control(fd, VIDIOC_QUERYCTRL, &q) == 0; q.id |= V4L2_CTRL_FLAG_NEXT_CTRL) {
        if (std::strcmp(reinterpret_cast<const char*>(q.name), name) != 0) continue;
        v4l2_control c = {q.id, value};
        if (control(fd, VIDIOC_S_CTRL, &c) != 0) return fail(name);
        return std::printf("%s = %d\n", name, value), 0;
    }
    return std::printf("no control '%s'\n", name), 1;
}

int extension(int fd, int selector, const std::vector<std::uint8_t>& bytes) {
    std::uint16_t size = 0;
    uvc_xu_control_query q{};
    q.unit = 3;
    q.selector = static_cast<std::uint8_t>(selector);
    q.query = UVC_GET_LEN;
    q.size = 2;
    q.data = reinterpret_cast<std::uint8_t*>(&size);
    if (control(fd, UVCIOC_CTRL_QUERY, &q) != 0) return fail("GET_LEN");
    std::vector<std::uint8_t> data(size, 0);
    q.size = size;
    q.data = data.data();
    if (!bytes.empty()) {
        std::copy_n(bytes.begin(), std::min<std::size_t>(bytes.size(), size), data.begin());
        q.query = UVC_SET_CUR;
        if (control(fd, UVCIOC_CTRL_QUERY, &q) != 0) return fail("SET_CUR");
    }
    q.query = UVC_GET_CUR;
    if (control(fd, UVCIOC_CTRL_QUERY, &q) != 0) return fail("GET_CUR");
    for (int i = 0; i < std::min<int>(size, 40); ++i) std::printf("%02x", data[static_cast<std::size_t>(i)]);
    return std::printf(" (%u bytes)\n", size), 0;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 3) return std::fputs(kUsage, stderr), 2;
    const std::string verb = argv[2];
    const int fd = open(argv[1], O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) return fail(argv[1]);
    v4l2_capability capability{};
    if (control(fd, VIDIOC_QUERYCAP, &capability) != 0) return fail("QUERYCAP");
    const int type = (capability.device_caps & V4L2_CAP_META_CAPTURE) != 0 ? V4L2_BUF_TYPE_META_CAPTURE
                                                                           : V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (verb == "list") return list(fd, type);
    if (verb == "meta" && argc >= 6) return metadata(fd, argv[3], std::atoi(argv[4]), argv[5]);
    if (verb == "set" && argc >= 5) return set_control(fd, argv[3], std::atoi(argv[4]));
    if (verb == "xu" && argc >= 4) {
        std::vector<std::uint8_t> bytes;
        for (int i = 4; i < argc; ++i)
            bytes.push_back(static_cast<std::uint8_t>(std::strtoul(argv[i], nullptr, 16)));
        return extension(fd, std::atoi(argv[3]), bytes);
    }
    if (verb != "grab" || argc < 7) return std::fputs(kUsage, stderr), 2;
    GrabOptions o;
    rig::Picture picture;
    const std::string code = argv[3];
    o.code = (code + "    ").substr(0, 4);
    o.big_endian = code.size() == 7 && code.substr(4) == "-BE";
    o.width = std::atoi(argv[4]), o.height = std::atoi(argv[5]), o.frames = std::atoi(argv[6]);
    for (int i = 7; i < argc; ++i) {
        const std::string a = argv[i];
        if (a == "--plain")
            o.plain = true;
        else if (a == "--until-gone")
            o.until_gone = true;
        else if (a == "--flagged-at-least" && i + 1 < argc)
            o.least_flagged = std::atoi(argv[++i]);
        else if (a == "--gaps-at-least" && i + 1 < argc)
            o.least_gaps = std::atoi(argv[++i]);
        else if (a == "--frames" && i + 1 < argc && picture.open(argv[i + 1]))
            o.picture = &picture, ++i;
        else if (a == "--timeout" && i + 1 < argc)
            o.timeout_s = std::atoi(argv[++i]);
        else if (a == "--damaged" && i + 1 < argc)
            o.damaged = std::atoi(argv[++i]);
        else if (a == "--save" && i + 1 < argc)
            o.save = argv[++i];
        else
            return std::fputs(kUsage, stderr), 2;
    }
    return grab(fd, type, o);
}
