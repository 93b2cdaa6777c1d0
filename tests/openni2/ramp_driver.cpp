// SPDX-License-Identifier: MIT
// An OpenNI2 driver with one device, "ramp:device", that sends depth and colour by formula. While the file
// named by the environment variable BURIN_RAMP_UNPLUG exists, the device is unplugged.
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <new>
#include <thread>

// The headers leave these to the driver.
#define XN_NEW(type, arg) new type(arg)
#define XN_DELETE(p) delete (p)
#include <Driver/OniDriverAPI.h>
#include <OniCAPI.h>

#include "openni2/ramp.h"

namespace {

constexpr OniVideoMode kDepthMode = {ONI_PIXEL_FORMAT_DEPTH_1_MM, kRampWidth, kRampHeight, kRampFps};
constexpr OniVideoMode kColourMode = {ONI_PIXEL_FORMAT_RGB888, kRampWidth, kRampHeight, kRampFps};
std::atomic<bool> unplugged{false};

class RampStream final : public oni::driver::StreamBase {
  public:
    explicit RampStream(OniSensorType type)
        : type_(type), mode_(type == ONI_SENSOR_DEPTH ? kDepthMode : kColourMode) {}
    ~RampStream() override { stop(); }
    OniStatus start() override {
        run_ = true;
        thread_ = std::thread([this] { send_all(); });
        return ONI_STATUS_OK;
    }
    void stop() override {
        run_ = false;
        if (thread_.joinable()) thread_.join();
    }
    OniStatus getProperty(int id, void* data, int* size) override {
        switch (id) {
            case ONI_STREAM_PROPERTY_VIDEO_MODE:
                return give(data, size, mode_);
            case ONI_STREAM_PROPERTY_HORIZONTAL_FOV:
                return give(data, size, 1.0145f);
            case ONI_STREAM_PROPERTY_VERTICAL_FOV:
                return give(data, size, 0.7898f);
            case ONI_STREAM_PROPERTY_MAX_VALUE:
                return give(data, size, type_ == ONI_SENSOR_DEPTH ? 10000 : 255);
            case ONI_STREAM_PROPERTY_MIN_VALUE:
                return give(data, size, 0);
            case ONI_STREAM_PROPERTY_STRIDE:
                return give(data, size, kRampWidth * pixel_bytes());
            // A recording without it plays back nothing at all.
            case ONI_STREAM_PROPERTY_CROPPING:
                return give(data, size, OniCropping{});
            case ONI_STREAM_PROPERTY_MIRRORING:
                return give(data, size, mirrored_);
        }
        return ONI_STATUS_NOT_IMPLEMENTED;
    }
    OniBool isPropertySupported(int id) override {
        char buffer[64];
        int size = sizeof buffer;
        return getProperty(id, buffer, &size) == ONI_STATUS_OK;
    }
    OniStatus setProperty(int id, const void* data, int size) override {
        if (id == ONI_STREAM_PROPERTY_VIDEO_MODE && size == static_cast<int>(sizeof mode_) &&
            !std::memcmp(data, &mode_, sizeof mode_))
            return ONI_STATUS_OK;
        if (id == ONI_STREAM_PROPERTY_MIRRORING && size == static_cast<int>(sizeof mirrored_)) {
            std::memcpy(&mirrored_, data, sizeof mirrored_);
            return ONI_STATUS_OK;
        }
        return ONI_STATUS_NOT_IMPLEMENTED;
    }
    // What a recorder writes into its file.
    void notifyAllProperties() override {
        for (int id = 0; id < 8; ++id) {
            char buffer[64];
            int size = sizeof buffer;
            if (getProperty(id, buffer, &size) == ONI_STATUS_OK) raisePropertyChanged(id, buffer, size);
        }
    }

  private:
    template <class T>
    static OniStatus give(void* data, int* size, const T& value) {
        if (*size < static_cast<int>(sizeof value)) return ONI_STATUS_BAD_PARAMETER;
        std::memcpy(data, &value, sizeof value);
        *size = sizeof value;
        return ONI_STATUS_OK;
    }
    int pixel_bytes() const { return type_ == ONI_SENSOR_DEPTH ? 2 : 3; }

    void send_all() {
        auto next = std::chrono::steady_clock::now();
        for (int n = 1; run_; ++n) {
            next += std::chrono::microseconds(1000000 / kRampFps);
            std::this_thread::sleep_until(next);
            if (unplugged) continue;
            OniFrame* frame = getServices().acquireFrame();
            if (!frame) continue;
            for (int y = 0; y < kRampHeight; ++y)
                for (int x = 0; x < kRampWidth; ++x) {
                    const int pixel = y * kRampWidth + x;
                    if (type_ == ONI_SENSOR_DEPTH) {
                        static_cast<std::uint16_t*>(frame->data)[pixel] = ramp_depth_mm(x, y, n);
                        continue;
                    }
                    for (int c = 0; c < 3; ++c)
                        static_cast<std::uint8_t*>(frame->data)[3 * pixel + c] = ramp_colour(x, y, c, n);
                }
            frame->frameIndex = n;
            frame->videoMode = mode_;
            frame->width = kRampWidth;
            frame->height = kRampHeight;
            frame->stride = kRampWidth * pixel_bytes();
            frame->cropOriginX = frame->cropOriginY = 0;
            frame->croppingEnabled = FALSE;
            frame->sensorType = type_;
            frame->timestamp = static_cast<std::uint64_t>(n) * 1000000 / kRampFps;
            raiseNewFrame(frame);
            getServices().releaseFrame(frame);
        }
    }

    OniSensorType type_;
    OniVideoMode mode_;
    OniBool mirrored_ = FALSE;
    std::atomic<bool> run_{false};
    std::thread thread_;
};

class RampDevice final : public oni::driver::DeviceBase {
  public:
    OniStatus getSensorInfoList(OniSensorInfo** sensors, int* count) override {
        *sensors = sensors_;
        *count = 2;
        return ONI_STATUS_OK;
    }
    oni::driver::StreamBase* createStream(OniSensorType type) override { return new RampStream(type); }
    void destroyStream(oni::driver::StreamBase* stream) override { delete stream; }

  private:
    OniVideoMode modes_[2] = {kDepthMode, kColourMode};
    OniSensorInfo sensors_[2] = {{ONI_SENSOR_DEPTH, 1, &modes_[0]}, {ONI_SENSOR_COLOR, 1, &modes_[1]}};
};

class RampDriver final : public oni::driver::DriverBase {
  public:
    explicit RampDriver(OniDriverServices* services) : DriverBase(services) {}
    OniStatus initialize(oni::driver::DeviceConnectedCallback connected,
                         oni::driver::DeviceDisconnectedCallback disconnected,
                         oni::driver::DeviceStateChangedCallback changed, void* cookie) override {
        DriverBase::initialize(connected, disconnected, changed, cookie);
        std::memset(&info_, 0, sizeof info_);
        std::strcpy(info_.uri, "ramp:device");
        std::strcpy(info_.vendor, "Burin");
        std::strcpy(info_.name, "ramp");
        deviceConnected(&info_);
        watcher_ = std::thread([this] { watch(); });
        return ONI_STATUS_OK;
    }
    oni::driver::DeviceBase* deviceOpen(const char* uri, const char*) override {
        return std::strcmp(uri, info_.uri) || unplugged ? nullptr : new RampDevice;
    }
    void deviceClose(oni::driver::DeviceBase* device) override { delete device; }
    void shutdown() override {
        run_ = false;
        if (watcher_.joinable()) watcher_.join();
    }

  private:
    void watch() {
        for (; run_; std::this_thread::sleep_for(std::chrono::milliseconds(10))) {
            const char* path = std::getenv("BURIN_RAMP_UNPLUG");
            const bool out = path && ::access(path, F_OK) == 0;
            if (out == unplugged) continue;
            unplugged = out;
            out ? deviceDisconnected(&info_) : deviceConnected(&info_);
        }
    }
    OniDeviceInfo info_;
    std::atomic<bool> run_{true};
    std::thread watcher_;
};

}  // namespace

ONI_EXPORT_DRIVER(RampDriver)
