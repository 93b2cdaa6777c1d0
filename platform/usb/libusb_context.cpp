// SPDX-License-Identifier: MIT
// What the list and the open device share of libusb: its context, its error codes, where a device is plugged.
#include <cstdio>

#include "platform/usb/libusb_io.h"

namespace burin {

Status status_of_libusb(int code, const char* what) {
    switch (code) {
        case LIBUSB_ERROR_NO_DEVICE:
        case LIBUSB_ERROR_NOT_FOUND:
            return Status::error(Code::disconnected, "%s is unplugged", what);
        case LIBUSB_ERROR_ACCESS:
            return Status::error(
                Code::denied,
                "%s: no permission; install 60-burin.rules in /etc/udev/rules.d, run udevadm control "
                "--reload and plug the device in again",
                what);
        case LIBUSB_ERROR_BUSY:
            return Status::error(Code::busy, "%s is in use by another program", what);
        case LIBUSB_ERROR_NO_MEM:
            return Status::error(Code::insufficient_memory,
                                 "%s: no memory for transfers (the limit of all USB devices is in "
                                 "/sys/module/usbcore/parameters/usbfs_memory_mb)",
                                 what);
        case LIBUSB_ERROR_TIMEOUT:
            return Status::error(Code::timeout, "%s has not answered", what);
        default:
            return Status::error(Code::io, "%s: %s", what, libusb_error_name(code));
    }
}

void place_of(libusb_device* device, char* text, int size) {
    std::uint8_t ports[7];  // as deep as USB goes
    const int count = libusb_get_port_numbers(device, ports, sizeof ports);
    int used = std::snprintf(text, static_cast<std::size_t>(size), "%d", libusb_get_bus_number(device));
    for (int i = 0; i < count && used < size; ++i)
        used += std::snprintf(text + used, static_cast<std::size_t>(size - used), "%c%d", i ? '.' : '-',
                              ports[i]);
}

Status libusb_begin(libusb_context** context, bool wraps_descriptor) {
    int code = libusb_init(context);
#if LIBUSB_API_VERSION >= 0x01000108
    if (code != 0 && wraps_descriptor) {
        // Android lets nobody look for devices; the descriptor is all there is.
        libusb_set_option(nullptr, LIBUSB_OPTION_NO_DEVICE_DISCOVERY);
        code = libusb_init(context);
    }
#else
    (void)wraps_descriptor;
#endif
    if (code != 0) return Status::error(Code::io, "usb: libusb cannot begin: %s", libusb_error_name(code));
    return {};
}

}  // namespace burin
