// SPDX-License-Identifier: MIT
#include "capture/recording_format.h"

#include <algorithm>
#include <cmath>

#include "capture/crc32.h"

namespace burin {

RecordedCamera recorded_camera(const Camera& c) {
    return {c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3};
}

Camera camera_of(const RecordedCamera& r, int width, int height) {
    return {width, height, r.fx, r.fy, r.cx, r.cy, r.k1, r.k2, r.p1, r.p2, r.k3};
}

RecordedPose recorded_pose(const Se3& T) {
    RecordedPose r;
    std::copy_n(T.R.m, 9, r.R);
    r.t[0] = T.t.x, r.t[1] = T.t.y, r.t[2] = T.t.z;
    return r;
}

Se3 pose_of(const RecordedPose& r) {
    Se3 T;
    std::copy_n(r.R, 9, T.R.m);
    T.t = {r.t[0], r.t[1], r.t[2]};
    return T;
}

bool pose_is_rigid(const RecordedPose& p) {
    for (const double t : p.t)
        if (!std::isfinite(t)) return false;
    const Se3 T = pose_of(p);
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b)
            if (!(std::fabs(dot(T.R.column(a), T.R.column(b)) - (a == b)) < 1e-3)) return false;
    return T.R.determinant() > 0;
}

void seal_head(RecordHead* head) { head->head_crc = crc32(head, offsetof(RecordHead, head_crc)); }

bool head_is_whole(const RecordHead& head) {
    return head.magic == kRecordMagic && head.head_crc == crc32(&head, offsetof(RecordHead, head_crc));
}

}  // namespace burin
