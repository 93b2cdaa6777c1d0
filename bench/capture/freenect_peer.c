/* SPDX-License-Identifier: MIT */
/* libfreenect's own unpacking and registration under names that can be loaded: the library that is installed
 * keeps these functions to itself. bench/capture/run.sh compiles this beside a copy of its sources (0.6 or
 * 0.7), which is not part of this repository. */
#include "cameras.c"
#include "registration.c"

void peer_unpack_11(uint8_t* packed, uint16_t* out, int pixels) {
    convert_packed11_to_16bit(packed, out, pixels);
}

static freenect_device device;

/* The 29 numbers of the registration, constant shift, and zero plane of one sensor. */
void peer_configure(const int32_t numbers[29], double const_shift, float emitter_distance,
                    float colour_distance, float reference_distance, float pixel_size) {
    freenect_registration* r = &device.registration;
    memcpy(&r->reg_info, numbers, sizeof r->reg_info);
    memset(&r->reg_pad_info, 0, sizeof r->reg_pad_info);
    r->zero_plane_info.dcmos_emitter_dist = emitter_distance;
    r->zero_plane_info.dcmos_rcmos_dist = colour_distance;
    r->zero_plane_info.reference_distance = reference_distance;
    r->zero_plane_info.reference_pixel_size = pixel_size;
    r->const_shift = const_shift;
    freenect_init_registration(&device);
}

void peer_depth_11(uint8_t* packed, uint16_t* out) { freenect_apply_depth_to_mm(&device, packed, out); }
void peer_register_11(uint8_t* packed, uint16_t* out) {
    freenect_apply_registration(&device, packed, out, false);
}
