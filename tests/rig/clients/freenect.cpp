// SPDX-License-Identifier: MIT
// rig_freenect: libfreenect as a judge of the emulated Kinect.
//     rig_freenect FRAMES depth11|depth10|mm|registered|bayer|uyvy|ir|both|motor [OPTION]...
//     --faulty      libfreenect delivers frames with packets missing too: wrong pixels are no failure
//     --save FILE   the last depth frame, u16 (of `registered` and of a --still emulator something to compare
//     with)
#include <libfreenect.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <vector>

#include "../emulators/ps_protocol.h"
#include "../pattern.h"

namespace {

struct Count {
    rig::Format format;
    int frames = 0;
    long wrong = 0;
    enum { pattern, millimetres, unknown } what = pattern;
    std::vector<std::uint8_t> last;
    void take(const void* data) {
        const auto* bytes = static_cast<const std::uint8_t*>(data);
        if (format.layout == rig::Layout::u16) last.assign(bytes, bytes + rig::format_bytes(format));
        ++frames;
        if (what == unknown) return;
        if (what == millimetres) {
            wrong += wrong_millimetres(bytes);
            return;
        }
        std::uint32_t n = 0;
        wrong +=
            static_cast<long>(rig::pattern_mismatches(format, static_cast<const std::uint8_t*>(data), &n));
    }
    // libfreenect knows no cut-off and clips at 10 m; so only readings with a distance between are compared.
    long wrong_millimetres(const std::uint8_t* bytes) const {
        const std::size_t n = 640 * 480;
        long least = static_cast<long>(n);
        for (std::uint32_t number = 0; number < 64 && least > 0; ++number) {  // the first frames of a stream
            long bad = 0;
            for (std::size_t i = 0; i < n && bad < least; ++i) {
                const int reading = static_cast<int>(rig::pattern(number, static_cast<std::uint32_t>(i % 640),
                                                                  static_cast<std::uint32_t>(i / 640)) &
                                                     2047);
                const int mm = rig::ps_depth_mm(rig::PsConstants(), reading);
                if (mm > 0 && mm != static_cast<int>(rig::get16(bytes + 2 * i))) ++bad;
            }
            least = std::min(least, bad);
        }
        return least;
    }
} depth, video;

int motor(freenect_device* device) {
    double x = 0, y = 0, z = 0;
    freenect_update_tilt_state(device);
    freenect_raw_tilt_state* state = freenect_get_tilt_state(device);
    freenect_get_mks_accel(state, &x, &y, &z);
    std::printf("raw acceleration %d %d %d, %.2f %.2f %.2f m/s2\n", state->accelerometer_x,
                state->accelerometer_y, state->accelerometer_z, x, y, z);
    return state->accelerometer_x == 41 && state->accelerometer_y == 812 && state->accelerometer_z == -123
               ? 0
               : 1;
}

}  // namespace

int main(int argc, char** argv) {
    using rig::Layout;
    if (argc < 3) return 2;
    const int want = std::atoi(argv[1]);
    const std::string what = argv[2];
    freenect_context* context = nullptr;
    freenect_device* device = nullptr;
    if (freenect_init(&context, nullptr) != 0) return std::puts("freenect_init failed"), 1;
    freenect_set_log_level(context,
                           std::getenv("RIG_VERBOSE") != nullptr ? FREENECT_LOG_SPEW : FREENECT_LOG_ERROR);
    freenect_select_subdevices(context, what == "motor" ? FREENECT_DEVICE_MOTOR : FREENECT_DEVICE_CAMERA);
    if (freenect_open_device(context, &device, 0) != 0)
        return std::puts("libfreenect cannot open the device"), 1;
    if (what == "motor") return motor(device);
    const bool with_depth =
                   what.compare(0, 5, "depth") == 0 || what == "both" || what == "mm" || what == "registered",
               with_video = !with_depth || what == "both";
    const bool ten = what == "depth10";
    // libfreenect unpacks 11 and 10 bits to 16; infrared frames have 488 rows.
    depth.format = {Layout::u16, ten ? 10 : 11, 640, 480};
    freenect_depth_format depth_format = ten ? FREENECT_DEPTH_10BIT : FREENECT_DEPTH_11BIT;
    if (what == "mm") depth_format = FREENECT_DEPTH_MM, depth.what = Count::millimetres;
    if (what == "registered") depth_format = FREENECT_DEPTH_REGISTERED, depth.what = Count::unknown;
    bool faulty = false;
    std::string save;
    for (int i = 3; i < argc; ++i) {
        if (std::strcmp(argv[i], "--faulty") == 0) faulty = true;
        if (std::strcmp(argv[i], "--save") == 0 && i + 1 < argc) save = argv[++i];
    }
    freenect_video_format video_format = FREENECT_VIDEO_BAYER;
    video.format = {Layout::u8, 8, 640, 480};
    if (what == "uyvy") video_format = FREENECT_VIDEO_YUV_RAW, video.format.columns = 1280;
    if (what == "ir") video_format = FREENECT_VIDEO_IR_10BIT, video.format = {Layout::u16, 10, 640, 488};
    if (freenect_set_depth_mode(device, freenect_find_depth_mode(FREENECT_RESOLUTION_MEDIUM, depth_format)) !=
            0 ||
        freenect_set_video_mode(device, freenect_find_video_mode(FREENECT_RESOLUTION_MEDIUM, video_format)) !=
            0)
        return std::puts("libfreenect refuses the mode"), 1;
    freenect_set_depth_callback(device, [](freenect_device*, void* p, std::uint32_t) { depth.take(p); });
    freenect_set_video_callback(device, [](freenect_device*, void* p, std::uint32_t) { video.take(p); });
    if (with_depth && freenect_start_depth(device) != 0)
        return std::puts("libfreenect cannot start depth"), 1;
    if (with_video && freenect_start_video(device) != 0)
        return std::puts("libfreenect cannot start video"), 1;
    const std::time_t until = std::time(nullptr) + 30;
    while (((with_depth && depth.frames < want) || (with_video && video.frames < want)) &&
           std::time(nullptr) < until)
        if (freenect_process_events(context) < 0) break;
    if (with_depth) freenect_stop_depth(device);
    if (with_video) freenect_stop_video(device);
    freenect_close_device(device);
    freenect_shutdown(context);
    std::printf("%d depth and %d video frames, %ld wrong pixels\n", depth.frames, video.frames,
                depth.wrong + video.wrong);
    const bool enough = (!with_depth || depth.frames >= want) && (!with_video || video.frames >= want);
    if (!save.empty()) {
        FILE* f = std::fopen(save.c_str(), "wb");
        if (f == nullptr || std::fwrite(depth.last.data(), 1, depth.last.size(), f) != depth.last.size() ||
            std::fclose(f) != 0)
            return std::perror(save.c_str()), 1;
    }
    return enough && (faulty || depth.wrong + video.wrong == 0) ? 0 : 1;
}
