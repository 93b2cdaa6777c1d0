// SPDX-License-Identifier: MIT
// Replies of the control channel: on their own, and as a device whose every answer is cut from the input,
// from opening to stopping.
#include <algorithm>

#include "fuzz/fuzz_checks.h"
#include "platform/usb/bytes.h"
#include "platform/usb/usb_sensor.h"

using namespace burin;

namespace {

// Then it is gone, so that every input ends: while answers are of another request, a millisecond passes with
// each.
constexpr int kRequests = 80;

class Answers final : public UsbIo {
  public:
    Answers(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
    int control(std::uint8_t type, std::uint8_t, std::uint16_t, std::uint8_t* out, int length, int) override {
        if (++requests_ > kRequests || size_ == 0) return kUsbGone;
        if (type == 0x40) {
            std::memcpy(header_, out + 4, 4);
            return length;
        }
        // A byte of the input says how the answer is made: as it stands, or with a head that would pass.
        const std::uint8_t how = next();
        const int n = std::min<int>(length, how % 128 * 4 + (how & 1));
        for (int i = 0; i < n; ++i) out[i] = next();
        if ((how & 128) && n >= 10) {
            out[0] = 0x52, out[1] = 0x42;
            put_le16(out + 2, static_cast<unsigned>((n - 8) / 2));
            std::memcpy(out + 4, header_, 4);
            put_le16(out + 8, 0);
        }
        return n > 0 ? n : static_cast<int>(kUsbStall);
    }
    bool endpoint(int alternate, std::uint8_t address, UsbEndpoint* found) override {
        *found = {address, alternate == 1 || kinect, 512};
        return true;
    }
    Status select_alternate(int) override { return {}; }
    Status open_pipe(const UsbEndpoint&, UsbReceiver*) override { return {}; }
    int close_pipes() override { return 0; }
    Status pump(std::int64_t) override { return {}; }
    bool read_later(std::uint8_t, int, UsbReceiver*) override { return false; }
    bool kinect = false;

  private:
    std::uint8_t next() {
        --size_;
        const std::uint8_t b = *data_++;
        if (size_ == 0) data_ = &zero_, size_ = 1;
        return b;
    }
    const std::uint8_t* data_;
    std::size_t size_;
    std::uint8_t zero_ = 0, header_[4] = {};
    int requests_ = 0;
};

class Nowhere final : public SourceSink {
  public:
    std::uint8_t* acquire(StreamKind) override { return nullptr; }
    void commit(StreamKind, std::uint8_t*, const ImageStamp&) override {}
    void abandon(StreamKind, std::uint8_t*) override {}
    void lend(StreamKind, const std::uint8_t*, std::size_t, std::uint64_t, int, const ImageStamp&) override {}
    void imu(const ImuSample&) override {}
    void count_damaged(StreamKind, int) override {}
    void log(LogLevel, const char*, ...) override __attribute__((format(printf, 3, 4))) {}
};

void check_line(const Status& s) {
    if (!s.ok()) fuzz::check_error(s);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 2) return 0;
    const int bytes = static_cast<int>(std::min<std::size_t>(size, kMaxReplyBytes));
    ControlReply reply;
    Status why;
    if (parse_reply(data, bytes, Opcode::get_param, 7, fuzz::kName.c_str(), &reply, &why) == ReplyKind::good)
        fuzz::check(reply.bytes >= 0 && reply.bytes % 2 == 0 && reply.data >= data &&
                    reply.data + reply.bytes <= data + bytes);
    else
        fuzz::check_error(why);

    Answers answers(data + 1, size - 1);
    answers.kinect = data[0] & 1;
    UsbSensor sensor(*find_sensor_model(answers.kinect ? 0x045e : 0x1d27, answers.kinect ? 0x02ae : 0x0601),
                     &answers, nullptr, fuzz::kName.c_str());
    SourceOptions options;
    options.streams = data[0] & 2 ? stream_bit(StreamKind::depth) | stream_bit(StreamKind::colour)
                                  : stream_bit(StreamKind::depth);
    SensorWishes wishes;
    wishes.isochronous = data[0] & 4;
    wishes.registered = data[0] & 8;
    DeviceInfo info;
    const Status opened = sensor.open(options, wishes, &info);
    if (!opened.ok()) {
        // "depth cannot be registered" has the name further on.
        if (!wishes.registered) check_line(opened);
        return 0;
    }
    for (const StreamInfo& s : info.streams)
        if (s.width > 0) fuzz::check(check_camera(s.camera, "it").ok() && s.image_bytes > 0);
    fuzz::check_rigid(info.at(StreamKind::colour).T_stream_depth);
    Nowhere sink;
    if (sensor.start(&sink).ok()) (void)sensor.stop();
    return 0;
}
