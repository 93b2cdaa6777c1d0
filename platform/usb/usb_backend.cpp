// SPDX-License-Identifier: MIT
#include "platform/usb/usb_backend.h"

#include <cstdio>
#include <cstring>
#include <new>

#include "capture/calibration.h"
#include "platform/usb/libusb_io.h"
#include "platform/usb/usb_list.h"

namespace burin {
namespace {

struct UsbDevice {
    LibusbIo camera, motor;
    UsbSensor sensor;
    UsbDevice(const SensorModel& model, bool has_motor, const char* name)
        : sensor(model, &camera, has_motor ? &motor : nullptr, name) {}
};

Status list(DeviceVisit visit, void* user) {
    struct Both {
        DeviceVisit visit;
        void* user;
    } both = {visit, user};
    return visit_usb_sensors(
        [](void* u, const UsbFound& found) {
            const auto* b = static_cast<Both*>(u);
            DeviceEntry entry;
            describe_usb_sensor(found, &entry);
            b->visit(b->user, entry);
            return true;
        },
        &both);
}

// The first sensor that the address means.
Status find(const char* text, const UsbAddress& address, UsbFound* found, DeviceEntry* entry) {
    struct Search {
        const UsbAddress* address;
        UsbFound* found;
        DeviceEntry* entry;
        bool any;
    } search = {&address, found, entry, false};
    BURIN_TRY(visit_usb_sensors(
        [](void* u, const UsbFound& one) {
            auto* s = static_cast<Search*>(u);
            const UsbAddress& a = *s->address;
            if ((a.vendor >= 0 && (a.vendor != one.model->vendor || a.product != one.model->product)) ||
                (a.place[0] && std::strcmp(a.place, one.place) != 0))
                return true;
            *s->found = one;
            s->found->device = nullptr;
            describe_usb_sensor(one, s->entry);
            s->any = true;
            return false;
        },
        &search));
    if (search.any) return {};
    return Status::error(Code::disconnected,
                         "usb: no sensor at '%.100s'; burin devices lists those there are", text);
}

Status open(const char* text, const SourceOptions& options, void** device, DeviceInfo* info) {
    UsbAddress address;
    BURIN_TRY(parse_usb_address(text, &address));
    UsbFound found;
    DeviceEntry entry;
    char motor_place[48] = "";
    bool has_motor = false;
    LibusbIo probe;
    if (options.fd >= 0) {
        // Which device it is, its own descriptor says.
        std::uint16_t vendor = 0, product = 0;
        BURIN_TRY(probe.open_descriptor(options.fd, "usb", &vendor, &product));
        probe.close();
        found.model = find_sensor_model(vendor, product);
        if (!found.model)
            return Status::error(Code::unsupported,
                                 "usb: descriptor %d is %04x:%04x, none of the sensors known", options.fd,
                                 vendor, product);
        std::snprintf(entry.name, sizeof entry.name, "%s", found.model->name);
    } else {
        BURIN_TRY(find(text, address, &found, &entry));
        if (entry.access == DeviceAccess::denied)
            return Status::error(Code::denied, "usb:%s (%s): %s", entry.address, entry.name, entry.hint);
        if (entry.access == DeviceAccess::busy)
            return Status::error(Code::busy, "usb:%s (%s): %s", entry.address, entry.name, entry.hint);
        has_motor = address.wishes.accelerometer && found.model->motor != 0 &&
                    usb_companion(found.place, found.model->vendor, found.model->motor, motor_place,
                                  sizeof motor_place);
    }
    char name[96];
    std::snprintf(name, sizeof name, "usb:%04x:%04x%s%.48s", found.model->vendor, found.model->product,
                  found.place[0] ? "@" : "", found.place);
    auto* d = new (std::nothrow) UsbDevice(*found.model, has_motor, name);
    if (!d) return Status::error(Code::insufficient_memory, "%s: no memory for the device", name);
    std::uint16_t vendor = 0, product = 0;
    Status opened = options.fd >= 0
                        ? d->camera.open_descriptor(options.fd, name, &vendor, &product)
                        : d->camera.open(found.place, found.model->vendor, found.model->product, name);
    // Without its motor device the camera is as good.
    if (opened.ok() && has_motor)
        (void)d->motor.open(motor_place, found.model->vendor, found.model->motor, "accelerometer");
    if (opened.ok()) opened = d->sensor.open(options, address.wishes, info);
    // What somebody measured goes before what the device tells.
    if (opened.ok() && options.calibration[0]) opened = read_calibration(options.calibration, info);
    if (!opened.ok()) {
        delete d;
        return opened;
    }
    std::snprintf(info->name, sizeof info->name, "%s", entry.name);
    std::snprintf(info->serial, sizeof info->serial, "%s", entry.serial);
    std::snprintf(info->location, sizeof info->location, "%s", entry.location);
    *device = d;
    return {};
}

UsbSensor& sensor(void* device) { return static_cast<UsbDevice*>(device)->sensor; }

Status start(void* device, SourceSink* sink) { return sensor(device).start(sink); }
Status pump(void* device, std::int64_t deadline_ns) { return sensor(device).pump(deadline_ns); }
Status stop(void* device) { return sensor(device).stop(); }
void close(void* device) {
    (void)sensor(device).stop();
    delete static_cast<UsbDevice*>(device);
}
Status get(void* device, SourceControl control, ControlRange* range) {
    return sensor(device).get(control, range);
}
Status set(void* device, SourceControl control, double value) { return sensor(device).set(control, value); }

}  // namespace

const SourceBackend kUsbBackend = {
    "usb",   "Kinect v1, PrimeSense PS1080 (Xtion, Carmine, Structure Sensor), Astra",
    list,    open,
    start,   pump,
    stop,    close,
    nullptr, get,
    set};

}  // namespace burin
