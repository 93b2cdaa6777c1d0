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
// Cancelled transfers come back at once from a healthy host controller.
constexpr std::int64_t kCancel_ns = 900'000'000;
constexpr int kMaxLater = 64;
constexpr unsigned kLater_ms = 250;

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

void LibusbIo::submit(Transfer& t) {
    t.done = false;
    t.flying = true;
    const int code = libusb_submit_transfer(t.usb);
    if (code == 0) return;
    t.flying = false;
    if (code == LIBUSB_ERROR_NO_DEVICE)
        gone_ = true;
    else
        failed_ = true, refused_ = code;
}

Status LibusbIo::open_pipe(const UsbEndpoint& endpoint, UsbReceiver* receiver) {
    if (count_ + kTransfers > kMaxTransfers - 1)
        return Status::error(Code::state, "%s has two pipes open already", name_);
    closing_ = false;
    const int packets = endpoint.isochronous ? kIsoPackets : 0;
    const int size = endpoint.isochronous ? kIsoPackets * endpoint.packet_bytes : kBulkBytes;
    for (int i = 0; i < kTransfers; ++i) {
        Transfer& t = transfers_[count_];
        t = Transfer();
        t.io = this;
        t.receiver = receiver;
        t.usb = libusb_alloc_transfer(packets);
        t.memory = new (std::nothrow) std::uint8_t[static_cast<std::size_t>(size)];
        if (!t.usb || !t.memory) {
            if (t.usb) libusb_free_transfer(t.usb);
            delete[] t.memory;
            t = Transfer();
            close_pipes();
            return Status::error(Code::insufficient_memory, "%s: no memory for %d transfers of %d bytes",
                                 name_, kTransfers, size);
        }
        pool_bytes_ += static_cast<std::size_t>(size);
        ++count_;
        if (endpoint.isochronous) {
            libusb_fill_iso_transfer(t.usb, handle_, endpoint.address, t.memory, size, packets, completed, &t,
                                     0);
            libusb_set_iso_packet_lengths(t.usb, static_cast<unsigned>(endpoint.packet_bytes));
        } else {
            libusb_fill_bulk_transfer(t.usb, handle_, endpoint.address, t.memory, size, completed, &t, 0);
        }
        submit(t);
        if (gone_ || failed_) {
            const Status why = status_of_libusb(gone_ ? LIBUSB_ERROR_NO_DEVICE : refused_, name_);
            close_pipes();
            return why;
        }
    }
    return {};
}

void LIBUSB_CALL LibusbIo::completed(libusb_transfer* usb) {
    if (!usb->user_data) return;  // left behind by close_pipes
    auto& t = *static_cast<Transfer*>(usb->user_data);
    LibusbIo& io = *t.io;
    bool ours;
    {
        const std::lock_guard lock(io.mutex_);
        t.flying = false;
        if (io.closing_) return;
        t.done = true;
        io.queue_[io.queued_++] = static_cast<int>(&t - io.transfers_);
        ours = io.pumping_ && pthread_equal(io.pump_thread_, pthread_self());
    }
    if (ours) io.drain();
}

// In the order of completion; by the pumping thread.
void LibusbIo::drain() {
    for (;;) {
        int next;
        {
            const std::lock_guard lock(mutex_);
            if (queued_ == 0) return;
            next = queue_[0];
            std::copy(queue_ + 1, queue_ + queued_, queue_);
            --queued_;
        }
        process(transfers_[next]);
    }
}

void LibusbIo::hand_over(Transfer& t) {
    libusb_transfer& usb = *t.usb;
    if (t.later) {
        t.receiver->bytes(libusb_control_transfer_get_data(&usb), usb.actual_length);
        return;
    }
    if (usb.num_iso_packets == 0) {
        if (usb.actual_length > 0) t.receiver->bytes(usb.buffer, usb.actual_length);
        return;
    }
    const std::uint8_t* at = usb.buffer;
    for (int i = 0; i < usb.num_iso_packets; ++i) {
        const libusb_iso_packet_descriptor& p = usb.iso_packet_desc[i];
        if (p.status != LIBUSB_TRANSFER_COMPLETED)
            t.receiver->lost();
        else if (p.actual_length > 0 && p.actual_length <= p.length)
            t.receiver->bytes(at, static_cast<int>(p.actual_length));
        at += p.length;
    }
}

void LibusbIo::process(Transfer& t) {
    switch (t.usb->status) {
        case LIBUSB_TRANSFER_COMPLETED:
            hand_over(t);
            break;
        case LIBUSB_TRANSFER_NO_DEVICE:
            gone_ = true;
            return;
        case LIBUSB_TRANSFER_CANCELLED:
            return;
        case LIBUSB_TRANSFER_STALL:
            // The endpoint is halted until told otherwise, which waits; the caller starts anew.
            failed_ = true, refused_ = LIBUSB_ERROR_PIPE;
            if (!t.later) return;
            failed_ = false;
            t.receiver->lost();
            break;
        default:  // error, timed out, overflow: what was in it is lost, the next may be whole
            t.receiver->lost();
            break;
    }
    t.done = false;
    if (!t.later && !gone_) submit(t);
}

Status LibusbIo::pump(std::int64_t deadline_ns) {
    if (!handle_) return Status::error(Code::state, "%s is not open", name_);
    {
        const std::lock_guard lock(mutex_);
        pump_thread_ = pthread_self();
        pumping_ = true;
    }
    drain();
    const std::int64_t wait_ns = std::clamp<std::int64_t>(deadline_ns - monotonic_ns(), 0, 1'000'000'000);
    timeval wait = {static_cast<time_t>(wait_ns / 1'000'000'000),
                    static_cast<suseconds_t>(wait_ns % 1'000'000'000 / 1000)};
    const int code = libusb_handle_events_timeout(context_, &wait);
    drain();
    {
        const std::lock_guard lock(mutex_);
        pumping_ = false;
    }
    if (gone_ || code == LIBUSB_ERROR_NO_DEVICE) return status_of_libusb(LIBUSB_ERROR_NO_DEVICE, name_);
    if (failed_) {
        failed_ = false;
        return Status::error(Code::io, "%s: a transfer was refused: %s", name_, libusb_error_name(refused_));
    }
    if (code != 0 && code != LIBUSB_ERROR_INTERRUPTED) return status_of_libusb(code, name_);
    return {};
}

bool LibusbIo::all_landed() {
    const std::lock_guard lock(mutex_);
    return std::none_of(transfers_, transfers_ + count_, [](const Transfer& t) { return t.flying; });
}

int LibusbIo::close_pipes() {
    if (count_ == 0) return 0;
    {
        const std::lock_guard lock(mutex_);
        closing_ = true;
        queued_ = 0;
    }
    for (int i = 0; i < count_; ++i)
        if (transfers_[i].flying) libusb_cancel_transfer(transfers_[i].usb);
    const std::int64_t until_ns = monotonic_ns() + kCancel_ns;
    while (!all_landed() && monotonic_ns() < until_ns) {
        timeval wait = {0, 10'000};
        libusb_handle_events_timeout(context_, &wait);
    }
    int left = 0;
    for (int i = 0; i < count_; ++i) {
        Transfer& t = transfers_[i];
        // One that the kernel does not give back still writes into its memory: both are left behind.
        if (t.flying) {
            t.usb->user_data = nullptr;
            ++left;
            continue;
        }
        libusb_free_transfer(t.usb);
        delete[] t.memory;
    }
    std::fill(transfers_, transfers_ + count_, Transfer());
    count_ = 0;
    pool_bytes_ = 0;
    failed_ = false;
    return left;
}

bool LibusbIo::read_later(std::uint8_t request, int length, UsbReceiver* receiver) {
    if (!handle_ || gone_ || length > kMaxLater) return false;
    Transfer* t = nullptr;
    for (int i = 0; i < count_; ++i)
        if (transfers_[i].later) t = &transfers_[i];
    if (!t) {
        if (count_ == kMaxTransfers) return false;
        t = &transfers_[count_];
        *t = Transfer();
        t->usb = libusb_alloc_transfer(0);
        t->memory = new (std::nothrow) std::uint8_t[LIBUSB_CONTROL_SETUP_SIZE + kMaxLater];
        if (!t->usb || !t->memory) {
            if (t->usb) libusb_free_transfer(t->usb);
            delete[] t->memory;
            *t = Transfer();
            return false;
        }
        t->io = this;
        t->later = true;
        closing_ = false;
        ++count_;
    }
    if (t->flying || t->done) return false;
    t->receiver = receiver;
    libusb_fill_control_setup(t->memory, 0xc0, request, 0, 0, static_cast<std::uint16_t>(length));
    libusb_fill_control_transfer(t->usb, handle_, t->memory, completed, t, kLater_ms);
    submit(*t);
    return t->flying;
}

}  // namespace burin
