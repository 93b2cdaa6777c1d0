// SPDX-License-Identifier: MIT
#include "platform/usb/usb_list.h"

#include <unistd.h>

#include <cstdio>
#include <cstring>

#include "platform/usb/libusb_io.h"
#include "platform/usb/sensor_modes.h"

namespace burin {
namespace {

// The kernel's driver of the first interface; "" when none has it.
void kernel_driver(const char* place, char* driver, int size) {
    char link[128], target[256];
    std::snprintf(link, sizeof link, "/sys/bus/usb/devices/%.48s:1.0/driver", place);
    const ssize_t length = ::readlink(link, target, sizeof target - 1);
    driver[0] = 0;
    if (length <= 0) return;
    target[length] = 0;
    const char* slash = std::strrchr(target, '/');
    std::snprintf(driver, static_cast<std::size_t>(size), "%.31s", slash ? slash + 1 : target);
}

void describe_formats(const SensorModel& model, char* text, int size) {
    const bool kinect = model.family == SensorFamily::kinect;
    int used = 0;
    for (const StreamKind kind : {StreamKind::depth, StreamKind::colour, StreamKind::infrared}) {
        if (kind == StreamKind::colour && !model.colour) continue;
        ModeList modes = kinect ? kinect_modes(kind) : primesense_modes(kind, false);
        if (modes.count > 1) modes.count = 1;  // the one that is taken when nothing is asked for
        char one[64];
        list_modes(modes, one, sizeof one);
        used += std::snprintf(text + used, static_cast<std::size_t>(size - used), "%s%s %s", used ? ", " : "",
                              stream_name(kind), one);
        if (used >= size) return;
    }
}

}  // namespace

void usb_serial(libusb_device_handle* handle, libusb_device* device, char* serial, int size) {
    serial[0] = 0;
    libusb_device_descriptor d;
    if (libusb_get_device_descriptor(device, &d) != 0 || d.iSerialNumber == 0) return;
    unsigned char text[128];
    const int length = libusb_get_string_descriptor_ascii(handle, d.iSerialNumber, text, sizeof text - 1);
    if (length <= 0) return;
    text[length] = 0;
    if (std::strspn(reinterpret_cast<char*>(text), "0") == static_cast<std::size_t>(length)) return;
    std::snprintf(serial, static_cast<std::size_t>(size), "%.*s", size - 1, reinterpret_cast<char*>(text));
}

Status visit_usb_sensors(bool (*visit)(void* user, const UsbFound& found), void* user) {
    libusb_context* context = nullptr;
    const Status begun = libusb_begin(&context, false);
    if (!begun.ok()) return Status::error(Code::unsupported, "%s", begun.text());
    libusb_device** list = nullptr;
    const ssize_t count = libusb_get_device_list(context, &list);
    for (ssize_t i = 0; i < count; ++i) {
        libusb_device_descriptor d;
        if (libusb_get_device_descriptor(list[i], &d) != 0) continue;
        UsbFound found;
        found.model = find_sensor_model(d.idVendor, d.idProduct);
        if (!found.model) continue;
        found.device = list[i];
        place_of(list[i], found.place, sizeof found.place);
        if (!visit(user, found)) break;
    }
    if (list) libusb_free_device_list(list, 1);
    libusb_exit(context);
    return {};
}

void describe_usb_sensor(const UsbFound& found, DeviceEntry* entry) {
    const SensorModel& m = *found.model;
    std::snprintf(entry->address, sizeof entry->address, "%04x:%04x@%s", m.vendor, m.product, found.place);
    std::snprintf(entry->name, sizeof entry->name, "%s", m.name);
    std::snprintf(entry->location, sizeof entry->location, "usb-%s", found.place);
    kernel_driver(found.place, entry->driver, sizeof entry->driver);
    describe_formats(m, entry->formats, sizeof entry->formats);
    libusb_device_handle* handle = nullptr;
    const int code = libusb_open(found.device, &handle);
    if (code == 0) {
        usb_serial(handle, found.device, entry->serial, sizeof entry->serial);
        libusb_close(handle);
    }
    if (code == LIBUSB_ERROR_ACCESS) {
        entry->access = DeviceAccess::denied;
        std::snprintf(
            entry->hint, sizeof entry->hint,
            "no permission for /dev/bus/usb/%03d/%03d: install 60-burin.rules in /etc/udev/rules.d, run "
            "'udevadm control --reload' and plug it in again",
            libusb_get_bus_number(found.device), libusb_get_device_address(found.device));
    } else if (code != 0) {
        entry->access = DeviceAccess::busy;
        std::snprintf(entry->hint, sizeof entry->hint, "the system does not open it (%s): plug it in again",
                      libusb_error_name(code));
    } else if (std::strcmp(entry->driver, "usbfs") == 0) {
        entry->access = DeviceAccess::busy;
        std::snprintf(entry->hint, sizeof entry->hint,
                      "another program has it open: end that, or plug the sensor in again");
    }
}

bool usb_companion(const char* place, std::uint16_t vendor, std::uint16_t product, char* companion,
                   int size) {
    const char* last = std::strrchr(place, '.');
    if (!last) last = std::strrchr(place, '-');
    if (!last) return false;
    struct Search {
        std::size_t hub;
        const char* place;
        std::uint16_t vendor, product;
        char* found;
        int size;
        bool any;
    } search = {static_cast<std::size_t>(last - place + 1), place, vendor, product, companion, size, false};
    libusb_context* context = nullptr;
    if (!libusb_begin(&context, false).ok()) return false;
    libusb_device** list = nullptr;
    const ssize_t count = libusb_get_device_list(context, &list);
    for (ssize_t i = 0; i < count && !search.any; ++i) {
        libusb_device_descriptor d;
        char here[48];
        if (libusb_get_device_descriptor(list[i], &d) != 0 || d.idVendor != vendor || d.idProduct != product)
            continue;
        place_of(list[i], here, sizeof here);
        if (std::strncmp(here, place, search.hub) != 0 || std::strchr(here + search.hub, '.')) continue;
        std::snprintf(companion, static_cast<std::size_t>(size), "%s", here);
        search.any = true;
    }
    if (list) libusb_free_device_list(list, 1);
    libusb_exit(context);
    return search.any;
}

}  // namespace burin
