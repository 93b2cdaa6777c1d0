// SPDX-License-Identifier: MIT
// What the IMU says of the motion from one tracked frame on, in the IMU's axes at that frame, so that no pose
// is needed to sum it up (preintegration: Lupton, Sukkarieh, TRO 2012; Forster et al., TRO 2017).
#pragma once

#include <cstdint>

#include "core/imu.h"
#include "core/se3.h"

namespace burin {

class ImuIntegral {
  public:
    void clear() { *this = {}; }
    // Starts anew at t_ns. Samples that lie ahead are kept.
    void begin(std::int64_t t_ns, Vec3d gyro_bias_rad_s);
    // Goes on to t_ns. Samples come in any portions: one that was there already, one whose stamp does not
    // rise and one that is not finite are passed over. Before begin() it only takes note of them.
    void add_until(std::int64_t t_ns, const ImuSample* samples, int count);

    // True when samples cover all of `from_ns` to `to_ns` and it is these that were integrated.
    bool covers(std::int64_t from_ns, std::int64_t to_ns) const {
        return begun_ && whole_ && used_ && from_ns == begin_ns_ && to_ns == now_ns_;
    }

    // Axes of the IMU now into those at the beginning, and with t the seconds since the beginning and f the
    // specific force: integrals over the time of R f, t R f, R and t R.
    Quaternion turn() const { return turn_; }
    Vec3d force() const { return force_; }
    Vec3d force_moment() const { return force_moment_; }
    const Mat3d& turns() const { return turns_; }
    const Mat3d& turns_moment() const { return turns_moment_; }

  private:
    void integrate(const ImuSample& a, const ImuSample& b, std::int64_t until_ns);
    void take(const ImuSample& sample, std::int64_t t_ns);

    bool begun_ = false, whole_ = true, used_ = false;
    std::int64_t begin_ns_ = 0, now_ns_ = 0;
    Vec3d gyro_bias_;
    Quaternion turn_;
    Vec3d force_, force_moment_;
    Mat3d turns_, turns_moment_;
    bool has_last_ = false, has_ahead_ = false;
    ImuSample last_, ahead_;  // the newest at or before now, and the first one past it
};

}  // namespace burin
