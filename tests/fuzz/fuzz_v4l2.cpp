// SPDX-License-Identifier: MIT
// Bytes of a V4L2 device: the first says which parser they are for.
#include <cstddef>
#include <cstdint>
#include <string>

#include "capture/calibration.h"
#include "platform/v4l2/d4xx_tables.h"
#include "platform/v4l2/raw_layout.h"
#include "platform/v4l2/uvc_metadata.h"

using namespace burin;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 1) return 0;
    const std::uint8_t which = data[0];
    ++data, --size;
    Camera camera;
    double baseline_m = 0;
    Se3 T_colour_depth;
    std::uint8_t command[24];
    const std::uint8_t* answer = nullptr;
    std::size_t bytes = 0;
    char serial[16];
    switch (which % 6) {
        case 0:
            (void)parse_uvc_metadata(data, size, (which & 8) != 0);
            break;
        case 1:
            (void)uvc_clock_hz(data, size, which >> 4);
            break;
        case 2:
            (void)d4xx_depth_camera(data, size, 640, 480, &camera, &baseline_m);
            (void)d4xx_colour_camera(data, size, 640, 480, &camera, &T_colour_depth);
            break;
        case 3:
            d4xx_table_command(D4xxTable::colour, command);
            if (d4xx_answer(command, data, size, &answer, &bytes).ok())
                (void)d4xx_serial(answer, bytes, serial);
            break;
        case 4: {
            RawLayout layout;
            (void)parse_raw_layout(std::string(reinterpret_cast<const char*>(data), size).c_str(), &layout);
            break;
        }
        default: {
            DeviceInfo info;
            info.at(StreamKind::depth).width = 640;
            info.at(StreamKind::depth).height = 480;
            (void)parse_calibration(std::string(reinterpret_cast<const char*>(data), size).c_str(), "fuzz",
                                    &info);
        }
    }
    return 0;
}
