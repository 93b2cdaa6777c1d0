// SPDX-License-Identifier: MIT
// rig_openni: OpenNI2's PS1080 driver as a judge of the emulated one.
//     rig_openni FRAMES depth FORMAT [iso] | yuv FORMAT | grey FORMAT | ir      (FORMAT: the device's input
//     format)
#include <OpenNI.h>
#include <PS1080.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "../emulators/ps_protocol.h"
#include "../pattern.h"

namespace {

int fail(const char* what) {
    std::string text = openni::OpenNI::getExtendedError();
    for (char& c : text) c = c == '\n' || c == '\t' ? ' ' : c;
    return std::printf("%s: %s\n", what, text.c_str()), 1;
}

// Of millimetres: the frame is found by its first 64 pixels, then all are compared.
std::size_t depth_mismatches(const openni::VideoFrameRef& frame, const std::vector<int>& mm) {
    const auto* row = static_cast<const openni::DepthPixel*>(frame.getData());
    const auto at = [&](unsigned n, unsigned x, unsigned y) { return mm[rig::pattern(n, x, y) & 2047]; };
    unsigned n = 0;
    for (; n < 2048; ++n) {
        bool same = true;
        for (unsigned x = 0; x < 64 && same; ++x) same = row[x] == at(n, x, 0);
        if (same) break;
    }
    std::size_t wrong = 0;
    for (int y = 0; y < frame.getHeight(); ++y) {
        row = reinterpret_cast<const openni::DepthPixel*>(static_cast<const char*>(frame.getData()) +
                                                          static_cast<std::ptrdiff_t>(y) *
                                                              frame.getStrideInBytes());
        for (int x = 0; x < frame.getWidth(); ++x)
            wrong += row[x] != at(n, static_cast<unsigned>(x), static_cast<unsigned>(y)) ? 1 : 0;
    }
    return wrong;
}

}  // namespace

int main(int argc, char** argv) {
    using namespace openni;
    if (argc < 3) return 2;
    const int want = std::atoi(argv[1]), format = argc > 3 ? std::atoi(argv[3]) : -1;
    const std::string what = argv[2];
    if (std::getenv("RIG_VERBOSE") != nullptr)
        OpenNI::setLogConsoleOutput(true), OpenNI::setLogMinSeverity(0);
    if (OpenNI::initialize() != STATUS_OK) return fail("initialize");
    // The driver looks for devices on a thread of its own.
    Array<DeviceInfo> found;
    for (int i = 0; i < 100 && found.getSize() == 0; ++i) {
        OpenNI::enumerateDevices(&found);
        usleep(50000);
    }
    Device device;
    if (device.open(ANY_DEVICE) != STATUS_OK) return fail("open");
    if (argc > 4 && std::strcmp(argv[4], "iso") == 0) {
        const unsigned long long iso = 1;  // XnSensorUsbInterface: isochronous endpoints
        if (device.setProperty(XN_MODULE_PROPERTY_USB_INTERFACE, iso) != STATUS_OK)
            return fail("isochronous");
    }
    const SensorType sensor = what == "depth" ? SENSOR_DEPTH : what == "ir" ? SENSOR_IR : SENSOR_COLOR;
    VideoStream stream;
    if (stream.create(device, sensor) != STATUS_OK) return fail("create");
    if (format >= 0 && stream.setProperty(XN_STREAM_PROPERTY_INPUT_FORMAT, format) != STATUS_OK)
        return fail("input format");
    VideoMode mode;
    mode.setResolution(640, 480);
    mode.setFps(30);
    mode.setPixelFormat(what == "depth"  ? PIXEL_FORMAT_DEPTH_1_MM
                        : what == "ir"   ? PIXEL_FORMAT_GRAY16
                        : what == "grey" ? PIXEL_FORMAT_GRAY8
                        : format == 7    ? PIXEL_FORMAT_YUYV
                                         : PIXEL_FORMAT_YUV422);
    if (stream.setVideoMode(mode) != STATUS_OK) return fail("video mode");
    if (format >= 0 && stream.setProperty(XN_STREAM_PROPERTY_INPUT_FORMAT, format) != STATUS_OK)
        return fail("input format");
    stream.setMirroringEnabled(false);
    std::vector<int> mm(2048, 0);
    for (int s = 0; s < 2047; ++s) mm[static_cast<std::size_t>(s)] = rig::ps_depth_mm(rig::PsConstants(), s);
    if (stream.start() != STATUS_OK) return fail("start");
    int got = 0;
    std::size_t wrong = 0;
    for (; got < want; ++got) {
        VideoStream* streams = &stream;
        int ready = 0;
        if (OpenNI::waitForAnyStream(&streams, 1, &ready, 10000) != STATUS_OK)
            return std::printf("after %d frames ", got), fail("wait");
        VideoFrameRef frame;
        if (stream.readFrame(&frame) != STATUS_OK) return fail("read");
        if (what == "depth") {
            wrong += depth_mismatches(frame, mm);
        } else {
            const rig::Format f =
                what == "ir" ? rig::Format{rig::Layout::u16, 10, frame.getWidth(), frame.getHeight()}
                             : rig::Format{rig::Layout::u8, 8, frame.getWidth() * (what == "yuv" ? 2 : 1),
                                           frame.getHeight()};
            std::uint32_t n = 0;
            wrong += rig::pattern_mismatches(f, static_cast<const std::uint8_t*>(frame.getData()), &n,
                                             static_cast<std::size_t>(frame.getStrideInBytes()));
        }
    }
    stream.stop();
    stream.destroy();
    device.close();
    OpenNI::shutdown();
    std::printf("%d frames of %s %d, %zu wrong pixels\n", got, what.c_str(), format, wrong);
    return wrong == 0 ? 0 : 1;
}
