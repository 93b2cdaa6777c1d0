// SPDX-License-Identifier: MIT
// From the bytes of a pipe to data packets. Twelve bytes of header (docs/usb.md):
//
//   52 42 | kind, little-endian 16 | id, little-endian 16 | size with header, big-endian 16 | stamp,
//   little-endian 32
//
// PrimeSense devices send a stream of bytes in which packets lie anywhere. Kinect v1 sends one packet an
// isochronous packet; its size field is not read (no driver reads it), and its id is byte 5 alone.
#pragma once

#include <cstdint>

namespace burin {

inline constexpr int kPacketHeaderBytes = 12;

// High byte of the kind without its place in the frame.
enum class PacketStream : std::uint8_t { depth = 0x70, image = 0x80 };

struct PacketHeader {
    std::uint8_t kind = 0;  // 0x71 first of a depth frame, 0x72 middle, 0x75 last; 0x81.. image and infrared
    std::uint16_t id = 0;
    int payload = 0;  // bytes behind the header
    std::uint32_t stamp = 0;

    std::uint8_t stream() const { return kind & 0xf0; }
    bool first() const { return (kind & 0xf) == 1; }
    bool middle() const { return (kind & 0xf) == 2; }
    bool last() const { return (kind & 0xf) == 5; }
};

class PacketSink {
  public:
    virtual ~PacketSink() = default;
    virtual void packet_begin(const PacketHeader& header) = 0;
    virtual void packet_data(const std::uint8_t* data, int bytes) = 0;
    virtual void packet_end() = 0;
    // The rest of this packet is lost. Ends it.
    virtual void packet_broken() = 0;
    // Bytes that belong to no packet were skipped.
    virtual void garbage(int bytes) = 0;
};

// How packets lie in what bytes() is given.
enum class PacketFraming : std::uint8_t {
    stream,     // anywhere (bulk)
    datagrams,  // mostly at the beginning, as isochronous packets have it: what looks like a header there is
                // one, even when the packet before should go on
    whole,      // every call is one packet (Kinect v1)
};

// Never allocates, never fails: what is no packet is skipped and told.
class PacketParser {
  public:
    void reset(PacketSink* sink, PacketFraming framing) {
        *this = PacketParser(), sink_ = sink, framing_ = framing;
    }
    void bytes(const std::uint8_t* data, int length);
    // Bytes are missing here.
    void lost();

  private:
    void whole_packet(const std::uint8_t* data, int length);
    int search(const std::uint8_t* data, int length);
    int header(const std::uint8_t* data, int length);
    bool begin();

    PacketSink* sink_ = nullptr;
    PacketFraming framing_ = PacketFraming::stream;
    std::uint8_t header_[kPacketHeaderBytes] = {};
    int have_ = 0;  // bytes of the header
    int left_ = 0;  // bytes of the payload still to come
};

}  // namespace burin
