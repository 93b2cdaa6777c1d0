// SPDX-License-Identifier: MIT
#include "platform/usb/control_channel.h"

#include <algorithm>
#include <cstring>

#include "capture/monotonic.h"
#include "platform/usb/bytes.h"

namespace burin {
namespace {

constexpr int kHeaderBytes = 8;
// Of one transfer. The device answers within a few milliseconds; OpenNI2 waits for 5 s, which is longer than
// a call of ours may take.
constexpr int kTransfer_ms = 300;
// Between looks at a device that has no answer yet, and before asking again one that is not ready.
constexpr std::int64_t kLook_ns = 1'000'000, kNotReady_ns = 150'000'000;
constexpr unsigned kErrorNotReady = 13;

int left_ms(std::int64_t deadline_ns) {
    const std::int64_t left = (deadline_ns - monotonic_ns()) / 1'000'000;
    return static_cast<int>(std::clamp<std::int64_t>(left, 1, kTransfer_ms));
}

Status error_of_code(const char* name, Opcode opcode, unsigned error) {
    const bool unknown = error == 2 || error == 5;  // no such command, bad parameters
    const char* text = device_error_text(error);
    return Status::error(unknown                   ? Code::unsupported
                         : error == kErrorNotReady ? Code::timeout
                                                   : Code::io,
                         "%s: request %d was refused with error %u (%s)", name, static_cast<int>(opcode),
                         error, text ? text : "unknown");
}

}  // namespace

const char* device_error_text(unsigned error) {
    // OpenNI2, XnHostProtocol.h.
    constexpr const char* kTexts[] = {"none",
                                      "unknown error",
                                      "unknown command",
                                      "bad checksum",
                                      "bad packet size",
                                      "bad parameters",
                                      "I2C transaction failed",
                                      "file not found",
                                      "file not created",
                                      "file not written",
                                      "file not deleted",
                                      "file not read",
                                      "bad command size",
                                      "not ready",
                                      "overflow",
                                      "overlay not loaded",
                                      "file system locked"};
    return error < sizeof kTexts / sizeof *kTexts ? kTexts[error] : nullptr;
}

ReplyKind parse_reply(const std::uint8_t* bytes, int size, Opcode opcode, std::uint16_t tag, const char* name,
                      ControlReply* reply, Status* why) {
    const int op = static_cast<int>(opcode);
    if (size < kHeaderBytes + 2) {
        *why = Status::error(Code::format, "%s: the reply to request %d has %d bytes, expected at least %d",
                             name, op, size, kHeaderBytes + 2);
        return ReplyKind::broken;
    }
    if (bytes[0] != 0x52 || bytes[1] != 0x42) {
        *why =
            Status::error(Code::format, "%s: the reply to request %d begins with %02x %02x, expected 52 42",
                          name, op, bytes[0], bytes[1]);
        return ReplyKind::broken;
    }
    if (le16(bytes + 6) != tag) {
        *why = Status::error(Code::format, "%s: the reply to request %d has tag %u, expected %u", name, op,
                             le16(bytes + 6), tag);
        return ReplyKind::stale;
    }
    if (le16(bytes + 4) != op) {
        *why = Status::error(Code::format, "%s: the reply to request %d is one to %u", name, op,
                             le16(bytes + 4));
        return ReplyKind::broken;
    }
    const int words = le16(bytes + 2);
    if (words < 1 || kHeaderBytes + 2 * words > size) {
        *why = Status::error(Code::format, "%s: the reply to request %d claims %d words, %d bytes came", name,
                             op, words, size);
        return ReplyKind::broken;
    }
    reply->error = le16(bytes + kHeaderBytes);
    reply->data = bytes + kHeaderBytes + 2;
    reply->bytes = 2 * (words - 1);
    return ReplyKind::good;
}

Status ControlChannel::failed(Opcode opcode, int error) const {
    const int op = static_cast<int>(opcode);
    switch (error) {
        case kUsbGone:
            return Status::error(Code::disconnected, "%s is unplugged", name_);
        case kUsbTimeout:
            return Status::error(Code::timeout, "%s has not answered request %d within %d ms", name_, op,
                                 kRequest_ms);
        case kUsbStall:
            return Status::error(Code::io, "%s: request %d was stalled", name_, op);
        case kUsbDenied:
            return Status::error(Code::denied, "%s: no permission for request %d", name_, op);
        case kUsbBusy:
            return Status::error(Code::busy, "%s: busy at request %d", name_, op);
        default:
            return Status::error(Code::io, "%s: the system refused request %d", name_, op);
    }
}

Status ControlChannel::exchange(Opcode opcode, const std::uint16_t* words, int count,
                                std::int64_t deadline_ns, ControlReply* reply) {
    std::uint8_t request[kHeaderBytes + 2 * kMaxRequestWords] = {0x47, 0x4d};
    const std::uint16_t tag = tag_++;
    put_le16(request + 2, static_cast<unsigned>(count));
    put_le16(request + 4, static_cast<unsigned>(opcode));
    put_le16(request + 6, tag);
    for (int i = 0; i < count; ++i) put_le16(request + kHeaderBytes + 2 * i, words[i]);
    const int size = kHeaderBytes + 2 * count;
    int moved = io_->control(0x40, 0, 0, request, size, left_ms(deadline_ns));
    if (moved < 0) return failed(opcode, moved);
    if (moved != size)
        return Status::error(Code::io, "%s took %d of the %d bytes of request %d", name_, moved, size,
                             static_cast<int>(opcode));
    Status why = failed(opcode, kUsbTimeout);
    for (;;) {
        if (monotonic_ns() >= deadline_ns) return why;
        moved = io_->control(0xc0, 0, 0, reply_, kMaxReplyBytes, left_ms(deadline_ns));
        if (moved == kUsbTimeout) continue;
        if (moved < 0) return failed(opcode, moved);
        if (moved == 0) {  // no answer yet
            sleep_until_ns(monotonic_ns() + kLook_ns);
            continue;
        }
        switch (parse_reply(reply_, moved, opcode, tag, name_, reply, &why)) {
            case ReplyKind::good:
                return {};
            case ReplyKind::broken:
                return why;
            case ReplyKind::stale:  // the answer to a request that we had given up; ours comes next
                sleep_until_ns(monotonic_ns() + kLook_ns);
                continue;
        }
    }
}

Status ControlChannel::request(Opcode opcode, const std::uint16_t* words, int count, std::uint8_t* data,
                               int capacity, int* bytes) {
    const std::lock_guard lock(mutex_);
    if (count < 0 || count > kMaxRequestWords)
        return Status::error(Code::invalid_argument, "%s: a request of %d words, expected at most %d", name_,
                             count, kMaxRequestWords);
    const std::int64_t deadline_ns = monotonic_ns() + std::int64_t{kRequest_ms} * 1'000'000;
    ControlReply reply;
    for (;;) {
        BURIN_TRY(exchange(opcode, words, count, deadline_ns, &reply));
        if (reply.error != kErrorNotReady || monotonic_ns() + kNotReady_ns >= deadline_ns) break;
        sleep_until_ns(monotonic_ns() + kNotReady_ns);
    }
    if (reply.error != 0) return error_of_code(name_, opcode, reply.error);
    const int copied = std::min(reply.bytes, capacity);
    if (data && copied > 0) std::memcpy(data, reply.data, static_cast<std::size_t>(copied));
    if (bytes) *bytes = reply.bytes;
    return {};
}

Status ControlChannel::set_param(std::uint16_t param, std::uint16_t value) {
    const std::uint16_t words[] = {param, value};
    return request(Opcode::set_param, words, 2, nullptr, 0, nullptr);
}

Status ControlChannel::get_param(std::uint16_t param, std::uint16_t* value) {
    std::uint8_t data[2];
    int bytes = 0;
    BURIN_TRY(request(Opcode::get_param, &param, 1, data, 2, &bytes));
    if (bytes < 2)
        return Status::error(Code::format, "%s: the value of parameter %u has %d bytes, expected 2", name_,
                             param, bytes);
    *value = le16(data);
    return {};
}

Status ControlChannel::cmos(std::uint16_t reg, std::uint16_t value, std::uint16_t* answer) {
    const std::lock_guard lock(mutex_);
    const std::uint16_t words[] = {1, reg, value};
    ControlReply reply;
    BURIN_TRY(exchange(Opcode::kinect_cmos, words, 3, monotonic_ns() + std::int64_t{kRequest_ms} * 1'000'000,
                       &reply));
    // count, register, value: libfreenect takes the third word.
    if (reply.bytes < 4)
        return Status::error(Code::format, "%s: the reply about register %u has %d bytes, expected 4", name_,
                             reg & 0x7fffu, reply.bytes);
    *answer = le16(reply.data + 2);
    return {};
}

Status ControlChannel::get_cmos(std::uint16_t reg, std::uint16_t* value) {
    return cmos(reg & 0x7fff, 0, value);
}

Status ControlChannel::set_cmos(std::uint16_t reg, std::uint16_t value) {
    std::uint16_t ignored;
    return cmos(reg | 0x8000, value, &ignored);
}

}  // namespace burin
