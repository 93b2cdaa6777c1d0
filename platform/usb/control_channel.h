// SPDX-License-Identifier: MIT
// The control protocol that Kinect v1 and the PrimeSense devices share: requests and replies of little-endian
// 16-bit words on endpoint 0. docs/usb.md has the layout and its sources.
//
//   request  47 4D | words | opcode | tag | payload
//   reply    52 42 | words | opcode | tag | error | data        words counts error and data
#pragma once

#include <cstdint>
#include <mutex>

#include "core/status.h"
#include "platform/usb/usb_io.h"

namespace burin {

inline constexpr int kMaxReplyBytes = 512;   // OpenNI2 since firmware 5.0, and libfreenect
inline constexpr int kMaxRequestWords = 28;  // ours have at most 5
// All of a request with its repetitions. No call of a back end may block for longer than a second.
inline constexpr int kRequest_ms = 800;

enum class Opcode : std::uint16_t {
    version = 0,
    keep_alive = 1,
    get_param = 2,
    set_param = 3,
    fixed_params = 4,
    algorithm_params = 22,
    cmos_presets = 36,
    serial = 37,
    emitter = 42,
    kinect_cmos = 0x95,
};

struct ControlReply {
    std::uint16_t error = 0;  // 0: done
    const std::uint8_t* data = nullptr;
    int bytes = 0;  // of data, even
};

enum class ReplyKind { good, stale, broken };

// What a reply of `size` bytes is worth as an answer to the request. good: *reply points into it, whatever
// its error. stale: of an earlier request (another tag). broken: *why says what is wrong. `name` begins the
// message.
ReplyKind parse_reply(const std::uint8_t* bytes, int size, Opcode opcode, std::uint16_t tag, const char* name,
                      ControlReply* reply, Status* why);

// A device's error code in words; nullptr when none is known.
const char* device_error_text(unsigned error);

class ControlChannel {
  public:
    // `name` begins each message and must live as long as this.
    void attach(UsbIo* io, const char* name) { io_ = io, name_ = name; }

    // Sends and waits for the answer. Errors: timeout (no answer within kRequest_ms, the device stays not
    // ready), format (not what the protocol demands: size, magic, opcode, tag), unsupported (the device knows
    // no such command or parameter), io (another error code, or the system), disconnected, denied.
    // `data` gets at most `capacity` bytes of the answer, *bytes how many came.
    Status request(Opcode opcode, const std::uint16_t* words, int count, std::uint8_t* data, int capacity,
                   int* bytes);

    Status set_param(std::uint16_t param, std::uint16_t value);
    Status get_param(std::uint16_t param, std::uint16_t* value);
    // Opcode 0x95, Kinect only. The answer has a count of registers in place of the error code.
    Status get_cmos(std::uint16_t reg, std::uint16_t* value);
    Status set_cmos(std::uint16_t reg, std::uint16_t value);

  private:
    Status exchange(Opcode opcode, const std::uint16_t* words, int count, std::int64_t deadline_ns,
                    ControlReply* reply);
    Status cmos(std::uint16_t reg, std::uint16_t value, std::uint16_t* answer);
    Status failed(Opcode opcode, int error) const;

    UsbIo* io_ = nullptr;
    const char* name_ = "";
    std::mutex mutex_;  // set and get come beside start and stop
    std::uint16_t tag_ = 0;
    std::uint8_t reply_[kMaxReplyBytes];
};

}  // namespace burin
