// SPDX-License-Identifier: MIT
// What the driver needs of USB: one open device. libusb_io.h is the real one; tests have one that follows a
// script (tests/unit/usb_script.h).
#pragma once

#include <cstdint>

#include "core/status.h"

namespace burin {

// What control() answers when it moved nothing.
enum UsbError : int {
    kUsbTimeout = -1,
    kUsbStall = -2,  // the device refused the request
    kUsbGone = -3,   // unplugged
    kUsbDenied = -4,
    kUsbBusy = -5,
    kUsbFailed = -6,  // anything else
};

struct UsbEndpoint {
    std::uint8_t address = 0;
    bool isochronous = false;
    int packet_bytes = 0;  // of a bulk packet, or all of a microframe's
};

// Takes what comes in on a pipe. Called inside UsbIo::pump() only.
class UsbReceiver {
  public:
    virtual ~UsbReceiver() = default;
    // A piece of a bulk stream, or one isochronous packet; at least a byte. Gone after the call.
    virtual void bytes(const std::uint8_t* data, int length) = 0;
    // A transfer or an isochronous packet came to nothing: what was in it is missing.
    virtual void lost() = 0;
};

// Threads: pump by one, control and read_later by any one beside it, everything else while nobody pumps.
class UsbIo {
  public:
    virtual ~UsbIo() = default;

    // A request on endpoint 0 with index 0; bit 7 of `type` set reads. Bytes moved, or a UsbError.
    virtual int control(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint8_t* data,
                        int length, int timeout_ms) = 0;

    // False: that alternate setting of interface 0 has no such endpoint for input.
    virtual bool endpoint(int alternate, std::uint8_t address, UsbEndpoint* found) = 0;
    virtual Status select_alternate(int alternate) = 0;

    // Allocates a fixed pool of transfers and submits them all; they go round until close_pipes().
    virtual Status open_pipe(const UsbEndpoint& endpoint, UsbReceiver* receiver) = 0;
    // Cancels and frees all transfers. Nothing is received after it. Returns how many the system did not give
    // back within a second: their memory is left to it.
    virtual int close_pipes() = 0;

    // Hands over what has come in, waits for something until deadline_ns (CLOCK_MONOTONIC). disconnected:
    // unplugged. io: transfers cannot be submitted any more.
    virtual Status pump(std::int64_t deadline_ns) = 0;

    // Reads by control without waiting: the answer goes to the receiver from within pump(), a failure calls
    // lost(). False: the one before has not been answered, or the device is gone. At most 64 bytes.
    virtual bool read_later(std::uint8_t request, int length, UsbReceiver* receiver) = 0;
};

}  // namespace burin
