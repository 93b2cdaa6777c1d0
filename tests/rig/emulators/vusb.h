// SPDX-License-Identifier: MIT
// USB devices made of user-space code, plugged into this kernel's own vhci_hcd. That driver takes any
// connected stream socket for the other end of a USB/IP connection, so a socket pair does: no network and no
// usbip tools. Control, bulk, interrupt and isochronous transfers, and unlinking, as
// Documentation/usb/usbip_protocol.rst has them.
//
// One thread. Errors of the system end the program with a line: it is a test's tool.
#pragma once

#include <cstdint>
#include <list>
#include <string>
#include <vector>

#include "faults.h"

namespace rig {

enum UsbSpeed { kFullSpeed = 2, kHighSpeed = 3 };

// Results of control, in and out beside a number of bytes.
inline constexpr int kStall = -32;  // -EPIPE
inline constexpr int kLater = -11;  // nothing yet: the request stays, and is asked again each millisecond

struct Setup {
    std::uint8_t type, request;
    std::uint16_t value, index, length;
};

class UsbDevice {
  public:
    virtual ~UsbDevice() = default;

    std::vector<std::uint8_t> device;  // the device descriptor, 18 bytes
    std::vector<std::uint8_t> config;  // the whole configuration
    std::vector<std::string> strings;  // the first has index 1

    // A class or vendor request. In: fill data (setup.length bytes), return how many. Out: data holds
    // setup.length bytes; return them or kStall.
    virtual int control(const Setup& setup, std::uint8_t* data) = 0;
    virtual void set_alternate(int interface, int number) { (void)interface, (void)number; }
    // One bulk transfer or one isochronous packet of an IN endpoint (1..15), at most `size` bytes.
    virtual int in(int endpoint, std::uint8_t* out, int size) = 0;
    // The device was plugged in anew: everything as at power-on.
    virtual void reset() {}

    std::uint8_t alternate[8] = {};
};

class VirtualBus {
  public:
    explicit VirtualBus(Faults& faults) : faults_(faults) {}
    // Devices are not owned. Each gets a port of its own, the same one after each unplug.
    void add(UsbDevice& device, UsbSpeed speed = kHighSpeed);
    // Plugs all in and serves them until told to quit (by the fifo, or SIGTERM). Returns the process's exit
    // code.
    int run();

  private:
    struct Request {
        std::uint32_t sequence = 0;
        bool in = false;
        int endpoint = 0, length = 0, start_frame = 0;
        Setup setup{};
        std::vector<std::uint8_t> data;
        std::vector<std::uint32_t> packets;  // of an isochronous one: offset, length, actual, status
        bool never = false;
    };
    struct Port {
        UsbDevice* device = nullptr;
        UsbSpeed speed = kHighSpeed;
        int number = -1, socket = -1;
        std::list<Request> waiting;
    };

    bool plug(Port& port);
    void unplug(Port& port);
    bool receive(Port& port);  // false: the host has gone
    bool serve_waiting(Port& port);
    bool serve_one(Port& port, Request& request, bool* done);
    bool answer_control(Port& port, Request& request);
    int standard(UsbDevice& device, const Setup& setup, std::uint8_t* data);
    bool reply(Port& port, Request& request, int status, int actual, int errors);

    Faults& faults_;
    std::vector<Port> ports_;
    double replug_at_ = 0;
};

double now_s();  // CLOCK_MONOTONIC

// Descriptors and replies are written byte by byte.
inline void put16(std::vector<std::uint8_t>& v, unsigned x) {
    v.push_back(static_cast<std::uint8_t>(x)), v.push_back(static_cast<std::uint8_t>(x >> 8));
}
inline void put32(std::vector<std::uint8_t>& v, std::uint32_t x) { put16(v, x & 0xffff), put16(v, x >> 16); }
inline void set16(std::uint8_t* p, unsigned x) {
    p[0] = static_cast<std::uint8_t>(x), p[1] = static_cast<std::uint8_t>(x >> 8);
}
inline void set32(std::uint8_t* p, std::uint32_t x) { set16(p, x & 0xffff), set16(p + 2, x >> 16); }
inline unsigned get16(const std::uint8_t* p) { return static_cast<unsigned>(p[0] | p[1] << 8); }
inline std::uint32_t get32(const std::uint8_t* p) {
    return get16(p) | static_cast<std::uint32_t>(get16(p + 2)) << 16;
}

}  // namespace rig
