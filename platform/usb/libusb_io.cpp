// SPDX-License-Identifier: MIT
#include "platform/usb/libusb_io.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <new>

#include "capture/monotonic.h"

#if !defined(LIBUSB_API_VERSION) || LIBUSB_API_VERSION < 0x01000107
#error "libusb 1.0.23 or newer is needed: libusb_wrap_sys_device"
#endif

namespace burin {
namespace {

constexpr int kInterface = 0;

}  // namespace

Status LibusbIo::claim() {
    // The kernel's driver gets the interface back when it is released.
    libusb_set_auto_detach_kernel_driver(handle_, 1);
    const int code = libusb_claim_interface(handle_, kInterface);
    if (code != 0) return status_of_libusb(code, name_);
    claimed_ = true;
    return {};
}

Status LibusbIo::open(const char* place, std::uint16_t vendor, std::uint16_t product, const char* name) {
    close();
    std::snprintf(name_, sizeof name_, "%s", name);
    BURIN_TRY(libusb_begin(&context_, false));
    libusb_device** list = nullptr;
    const ssize_t count = libusb_get_device_list(context_, &list);
    int code = LIBUSB_ERROR_NO_DEVICE;
    for (ssize_t i = 0; i < count; ++i) {
        libusb_device_descriptor d;
        if (libusb_get_device_descriptor(list[i], &d) != 0 || d.idVendor != vendor || d.idProduct != product)
            continue;
        char here[48];
        place_of(list[i], here, sizeof here);
        if (std::strcmp(here, place) != 0) continue;
        code = libusb_open(list[i], &handle_);
        break;
    }
    if (list) libusb_free_device_list(list, 1);
    if (code != 0) {
        handle_ = nullptr;
        const Status why = status_of_libusb(code, name_);
        close();
        return why;
    }
    const Status claimed = claim();
    if (!claimed.ok()) close();
    return claimed;
}

Status LibusbIo::open_descriptor(int fd, const char* name, std::uint16_t* vendor, std::uint16_t* product) {
    close();
    std::snprintf(name_, sizeof name_, "%s", name);
    BURIN_TRY(libusb_begin(&context_, true));
    int code = libusb_wrap_sys_device(context_, static_cast<intptr_t>(fd), &handle_);
    libusb_device_descriptor d = {};
    if (code != 0) handle_ = nullptr;
    if (code == 0) code = libusb_get_device_descriptor(libusb_get_device(handle_), &d);
    if (code != 0) {
        const Status why = Status::error(Code::io, "%s: descriptor %d is no USB device: %s", name_, fd,
                                         libusb_error_name(code));
        close();
        return why;
    }
    *vendor = d.idVendor;
    *product = d.idProduct;
    const Status claimed = claim();
    if (!claimed.ok()) close();
    return claimed;
}

void LibusbIo::close() {
    close_pipes();
    if (handle_) {
        if (claimed_) libusb_release_interface(handle_, kInterface);
        libusb_close(handle_);
    }
    handle_ = nullptr;
    claimed_ = gone_ = failed_ = false;
    if (context_) libusb_exit(context_);
    context_ = nullptr;
}

int LibusbIo::control(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint8_t* data,
                      int length, int timeout_ms) {
    if (!handle_ || gone_) return kUsbGone;
    const int moved =
        libusb_control_transfer(handle_, type, request, value, 0, data, static_cast<std::uint16_t>(length),
                                static_cast<unsigned>(timeout_ms));
    switch (moved) {
        case LIBUSB_ERROR_TIMEOUT:
            return kUsbTimeout;
        case LIBUSB_ERROR_PIPE:
            return kUsbStall;
        case LIBUSB_ERROR_NO_DEVICE:
            return kUsbGone;
        case LIBUSB_ERROR_ACCESS:
            return kUsbDenied;
        case LIBUSB_ERROR_BUSY:
            return kUsbBusy;
        default:
            return moved < 0 ? kUsbFailed : moved;
    }
}

bool LibusbIo::endpoint(int alternate, std::uint8_t address, UsbEndpoint* found) {
    libusb_config_descriptor* config = nullptr;
    if (!handle_ || libusb_get_active_config_descriptor(libusb_get_device(handle_), &config) != 0)
        return false;
    bool any = false;
    for (int i = 0; i < config->bNumInterfaces; ++i)
        for (int a = 0; a < config->interface[i].num_altsetting; ++a) {
            const libusb_interface_descriptor& setting = config->interface[i].altsetting[a];
            if (setting.bInterfaceNumber != kInterface || setting.bAlternateSetting != alternate) continue;
            for (int e = 0; e < setting.bNumEndpoints; ++e) {
                const libusb_endpoint_descriptor& d = setting.endpoint[e];
                const int type = d.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK;
                if (d.bEndpointAddress != address ||
                    (type != LIBUSB_TRANSFER_TYPE_ISOCHRONOUS && type != LIBUSB_TRANSFER_TYPE_BULK))
                    continue;
                found->address = address;
                found->isochronous = type == LIBUSB_TRANSFER_TYPE_ISOCHRONOUS;
                // Bits 11 and 12: further transactions in a microframe (USB 2.0, 9.6.6).
                const int size = d.wMaxPacketSize & 0x7ff, more = d.wMaxPacketSize >> 11 & 3;
                found->packet_bytes = found->isochronous ? size * (1 + more) : size;
                any = true;
            }
        }
    libusb_free_config_descriptor(config);
    return any;
}

Status LibusbIo::select_alternate(int alternate) {
    const int code = libusb_set_interface_alt_setting(handle_, kInterface, alternate);
    return code == 0 ? Status() : status_of_libusb(code, name_);
}

}  // namespace burin
