// SPDX-License-Identifier: MIT
// UsbIo on libusb-1.0.
#pragma once

#include <libusb.h>
#include <pthread.h>

#include <mutex>

#include "platform/usb/usb_io.h"

namespace burin {

// Error: what the code means as a Status; `what` begins the text.
Status status_of_libusb(int code, const char* what);

// Bus and ports, as the kernel names the device in /sys/bus/usb/devices: "1-2.3".
void place_of(libusb_device* device, char* text, int size);

// A libusb context of its own. Error: io.
Status libusb_begin(libusb_context** context, bool wraps_descriptor);

class LibusbIo final : public UsbIo {
  public:
    LibusbIo() = default;
    ~LibusbIo() override { close(); }
    LibusbIo(const LibusbIo&) = delete;
    LibusbIo& operator=(const LibusbIo&) = delete;

    // The device with these ids at this place ("1-2.3", see place_of). Takes interface 0 from the kernel's
    // driver, which gets it back at close(). Errors: disconnected (not there any more), denied, busy, io.
    // `name` begins messages.
    Status open(const char* place, std::uint16_t vendor, std::uint16_t product, const char* name);
    // One that somebody else opened (Android); the descriptor stays theirs. Its ids are returned.
    Status open_descriptor(int fd, const char* name, std::uint16_t* vendor, std::uint16_t* product);
    void close();

    int control(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint8_t* data, int length,
                int timeout_ms) override;
    bool endpoint(int alternate, std::uint8_t address, UsbEndpoint* found) override;
    Status select_alternate(int alternate) override;
    Status open_pipe(const UsbEndpoint& endpoint, UsbReceiver* receiver) override;
    int close_pipes() override;
    Status pump(std::int64_t deadline_ns) override;
    bool read_later(std::uint8_t request, int length, UsbReceiver* receiver) override;

    // Bytes of transfers that are allocated now.
    std::size_t pool_bytes() const { return pool_bytes_; }

  private:
    // 32 ms of a microframe each for isochronous endpoints, and of half a megabyte for bulk: what a busy
    // machine may leave us waiting.
    static constexpr int kTransfers = 16, kIsoPackets = 16, kBulkBytes = 16384;
    static constexpr int kMaxTransfers = 2 * kTransfers + 1;
    struct Transfer {
        LibusbIo* io = nullptr;
        libusb_transfer* usb = nullptr;
        std::uint8_t* memory = nullptr;
        UsbReceiver* receiver = nullptr;
        bool flying = false, done = false, later = false;
    };

    static void LIBUSB_CALL completed(libusb_transfer* usb);
    Status claim();
    void process(Transfer& t);
    void hand_over(Transfer& t);
    void drain();
    bool all_landed();
    void submit(Transfer& t);

    libusb_context* context_ = nullptr;
    libusb_device_handle* handle_ = nullptr;
    bool claimed_ = false;
    char name_[96] = "";

    Transfer transfers_[kMaxTransfers];
    int count_ = 0;
    std::size_t pool_bytes_ = 0;
    // Transfers that completed, in order. Whoever waits in libusb runs the callbacks of all transfers, and a
    // control request of another thread waits there too; only pump() may hand anything over.
    std::mutex mutex_;
    int queue_[kMaxTransfers];
    int queued_ = 0;
    bool pumping_ = false, closing_ = false, gone_ = false, failed_ = false;
    pthread_t pump_thread_ = {};
    int refused_ = 0;  // the code of the last submission that failed
};

}  // namespace burin
