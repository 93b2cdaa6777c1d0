// SPDX-License-Identifier: MIT
#include "track/descent.h"

#include <algorithm>
#include <cmath>

namespace burin {
namespace {

// Below this the sensor's own noise model would be a tenth of what it is: numbers of a noise-free rendering.
constexpr double kLeastScale = 0.05, kMostScale = 1.5;

double largest(const double (&v)[3]) { return std::max({std::fabs(v[0]), std::fabs(v[1]), std::fabs(v[2])}); }

}  // namespace

double scale_of(double median) { return std::clamp(1.4826 * median, kLeastScale, kMostScale); }

Measured PoseMeasurement::begin_with_scale(const Se3& T_world_camera, int level) {
    const Measured first = measure(T_world_camera, level);
    const double own = scale_of(first.median);
    // The weights hardly change with a tenth of the scale.
    if (std::fabs(own - scale_) <= 0.1 * scale_) return first;
    scale_ = own;
    return measure(T_world_camera, level);
}

double cost_at(const Measured& m) {
    if (m.considered == 0) return kMissCost;
    return (m.system.cost + kMissCost * (m.considered - m.system.points)) / m.considered;
}

PoseFit descend(PoseMeasurement& measurement, const Se3& start, const MotionPriorTerm& prior,
                const DescentOptions& options) {
    PoseFit out;
    out.T_world_camera = start;
    const auto with_prior = [&](const Measured& m, const Se3& T) {
        Measured sum = m;
        if (prior.sigma_m > 0 || prior.sigma_rad > 0)
            sum.system.add_prior(motion_between(T, prior.T_world_camera), prior.sigma_m, prior.sigma_rad);
        return sum;
    };
    for (int level = TrackPoints::kLevels - 1; level >= options.finest; --level) {
        Measured here = measurement.begin_level(out.T_world_camera, level);
        ++out.evaluations;
        double damping = 1e-4;  // all but Gauss-Newton while steps succeed
        out.converged = false;
        for (int step = 0; step < options.steps[level]; ++step) {
            const Measured pulled = with_prior(here, out.T_world_camera);
            Twist xi;
            if (!pulled.system.solve(damping, &xi)) break;
            const bool small = largest(xi.v) < options.least_m && largest(xi.w) < options.least_rad;
            const Se3 T = moved(out.T_world_camera, xi);
            const Measured there = measurement.measure(T, level);
            ++out.evaluations;
            if (cost_at(with_prior(there, T)) <= cost_at(pulled)) {
                out.T_world_camera = T;
                here = there;
                damping = std::max(damping * 0.1, 1e-6);
                if (small) out.converged = true;
            } else {
                damping = std::max(damping * 10, 1e-2);
                if (small) out.converged = true;  // nothing left but rounding
            }
            if (out.converged) break;
        }
        out.measured = here;
        out.cost = cost_at(here);
        out.scale = scale_of(here.median);
    }
    return out;
}

}  // namespace burin
