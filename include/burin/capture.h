/* SPDX-License-Identifier: MIT
 *
 * Burin: frames from depth sensors, in pairs with their colour, with their own clocks and intrinsics.
 *
 *     burin_source source;
 *     burin_source_options options = burin_source_options_default();
 *     burin_source_open("v4l2:/dev/video0", &options, &source);
 *     burin_source_start(source);
 *     while (burin_source_next(source, 100000000, &captured) == BURIN_OK) {
 *         burin_frame_of_capture(source, &captured, &frame);
 *         burin_scan(map, &frame, &result);
 *     }
 *     burin_source_close(&source);
 *
 * Conventions are those of burin.h. Beside them
 *   addresses  "BACKEND:ADDRESS", as burin_devices lists them: "v4l2:/dev/video0", "usb:045e:02ae@1-2",
 * "null:" clocks     t_ns and host_ns are CLOCK_MONOTONIC; device_ns is the sensor's own clock, its
 * wrap-around undone memory     opening and starting allocate; while frames stream nothing is allocated (but
 * MJPEG colour is decoded by libjpeg, which takes some working memory for each image) threads    one source
 * is used by one thread at a time; a second is refused with STATE. Each streaming source has one thread of
 * its own. Sources are independent of each other and of maps errors     burin_source_error(source) holds one
 * line; that of the null source those of burin_source_open and burin_devices on this thread
 */
#ifndef BURIN_CAPTURE_H
#define BURIN_CAPTURE_H

#include "burin/burin.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---------------------------------------------------------------------------------------------------------
 * devices */

typedef enum burin_device_access {
    BURIN_DEVICE_READY = 0,
    BURIN_DEVICE_BUSY = 1,       /* another program has it */
    BURIN_DEVICE_DENIED = 2,     /* no permission; hint says what to do */
    BURIN_DEVICE_UNSUPPORTED = 3 /* plugged in, but its formats or protocol are none that we read */
} burin_device_access;

/* Texts end in a zero and may be empty where the device or the system tells nothing. */
typedef struct burin_device {
    char address[192]; /* for burin_source_open */
    char name[96];     /* for people */
    char serial[64];
    char location[64]; /* where it is plugged, the same after a replug */
    char driver[32];   /* of the kernel, that has it now */
    char formats[256]; /* "depth Z16 640x480@30, colour YUYV 640x480@30" */
    char hint[256];    /* when not READY: why, and what to do */
    uint32_t access;   /* a burin_device_access */
} burin_device;

/* The sensors that are plugged in, of all back ends. Writes at most `capacity` of them; *count: how many
 * there are. devices may be NULL with capacity 0. INSUFFICIENT_MEMORY: there are more than capacity. */
BURIN_API burin_status burin_devices(burin_device* devices, uint64_t capacity, uint64_t* count);

/* A back end of this build: name ("v4l2"), one line about it, and why it can list nothing here (an empty text
 * when it can). *_bytes: room in the texts, >= 1; what is longer is cut. INVALID_ARGUMENT: index >=
 * burin_backend_count(). */
BURIN_API uint32_t burin_backend_count(void);
BURIN_API burin_status burin_backend(uint32_t index, char* name, uint64_t name_bytes, char* about,
                                     uint64_t about_bytes, char* problem, uint64_t problem_bytes);

/* ---------------------------------------------------------------------------------------------------------
 * life of a source */

typedef enum burin_stream {
    BURIN_STREAM_DEPTH = 0,
    BURIN_STREAM_COLOUR = 1,
    BURIN_STREAM_INFRARED = 2,
    BURIN_STREAM_INFRARED_RIGHT = 3,
    BURIN_STREAM_CONFIDENCE = 4
} burin_stream;
#define BURIN_STREAMS 5
#define BURIN_STREAM_BIT(stream) (1u << (stream))

typedef enum burin_registration {
    BURIN_REGISTRATION_NONE = 0, /* each stream as it was captured: what burin_scan wants */
    /* Depth as the colour camera would see it, z-buffered, in its size; everything else is then told from
       there too. */
    BURIN_REGISTRATION_DEPTH_TO_COLOUR = 1,
    /* Colour as the depth camera would see it, RGB8 in its size; black where it does not see the surface. */
    BURIN_REGISTRATION_COLOUR_TO_DEPTH = 2
} burin_registration;

typedef struct burin_source_options {
    uint32_t struct_size; /* sizeof(burin_source_options) */
    uint32_t streams; /* BURIN_STREAM_BITs. Default depth and colour; those the device has not are left out */
    uint32_t depth_width, depth_height;   /* 0 (default): the device's choice; else this or an error */
    uint32_t colour_width, colour_height; /* the same */
    double fps;                           /* 0 (default): the fastest at that size */
    const char* depth_format;  /* by name, as burin_devices tells; NULL (default): the best. Copied, as all
                                  texts here */
    const char* colour_format; /* the same */
    const char*
        calibration;    /* path of a calibration file, for devices that know none of theirs; NULL: none */
    const char* layout; /* of raw words of time-of-flight boards, docs/v4l2.md; NULL: none */
    int32_t fd;         /* an open descriptor of the device in place of the address (Android); -1 (default) */
    uint32_t lossless;  /* 1: nothing is dropped here, a slow consumer holds up the device. Default 0: the
                           newest  frames win */
    uint32_t waiting_frames; /* that may wait for burin_source_next, 1 .. 32. Default 3 */
    uint32_t reconnect;      /* 1 (default): streams again when a device that was unplugged is back */
    uint32_t keep_damaged;   /* 1: images with parts missing are delivered too. Default 0 */
    uint32_t registration;   /* a burin_registration. Default NONE */
    uint32_t copy; /* 1: always copied out of the driver's buffers. Default 0: handed out from there where no
                      unpacking is needed */
    burin_log log; /* lines of this source, on any of its threads; NULL: none */
    void* log_user;
    uint64_t reserved[8]; /* zero */
} burin_source_options;

BURIN_API burin_source_options burin_source_options_default(void);

/* A value; {0, 0} is the null source. At most 16 at a time. */
typedef struct burin_source {
    uint32_t index, generation;
} burin_source;

/* Claims the device and reads its calibration. Errors: INVALID_ARGUMENT (options, an address of no back end),
 * DISCONNECTED (no such device), BUSY, DENIED, UNSUPPORTED (no such size, rate or format), TIMEOUT, FORMAT
 * (the device's replies are not what its protocol demands), IO, INSUFFICIENT_MEMORY, STATE (16 sources are
 * open). */
BURIN_API burin_status burin_source_open(const char* address, const burin_source_options* options,
                                         burin_source* source);
/* Stops and closes; *source becomes the null source. The kernel's driver gets the device back. */
BURIN_API burin_status burin_source_close(burin_source* source);
BURIN_API burin_status burin_source_start(burin_source source);
BURIN_API burin_status burin_source_stop(burin_source source);

/* The line of this source's last error; of the null source, that of this thread. Never NULL. */
BURIN_API const char* burin_source_error(burin_source source);

typedef enum burin_source_state {
    BURIN_SOURCE_CLOSED = 0,
    BURIN_SOURCE_OPEN = 1,
    BURIN_SOURCE_STREAMING = 2,
    BURIN_SOURCE_UNPLUGGED = 3, /* with reconnect it may stream again */
    BURIN_SOURCE_ENDED = 4,     /* a recording is over */
    BURIN_SOURCE_FAILED = 5     /* three restarts did not wake the device: stop, and start or close */
} burin_source_state;
BURIN_API burin_status burin_source_get_state(burin_source source, burin_source_state* state);

typedef struct burin_stream_info {
    uint32_t width, height;    /* 0: the source does not deliver this stream */
    uint32_t bytes_per_sample; /* of depth and infrared (1 or 2), confidence (1) */
    uint32_t pixel_format;     /* of colour: a burin_pixel_format */
    double fps;
    double unit_m;       /* of depth: metres a step */
    uint32_t calibrated; /* 0: the intrinsics are nominal, from the data sheet's field of view */
    char format[24];     /* as the device sends it */
    burin_camera camera;
    burin_pose T_stream_depth; /* depth camera coordinates to those of this stream's camera */
} burin_stream_info;

/* stream: a burin_stream. */
BURIN_API burin_status burin_source_stream(burin_source source, uint32_t stream, burin_stream_info* info);

/* ---------------------------------------------------------------------------------------------------------
 * frames */

typedef struct burin_image {
    const void* data;      /* NULL: the frame has no image of this stream */
    uint64_t stride_bytes; /* of a row */
    burin_camera camera;   /* of this image */
    int64_t t_ns; /* when it was taken, on the host's clock: the device's time mapped to it, drift and all */
    int64_t host_ns;   /* when its last byte had come */
    int64_t device_ns; /* on the device's clock; 0 without has_device_time */
    uint64_t sequence; /* the device's or its driver's */
    uint64_t lost;     /* images of this stream missing before this one */
    uint32_t has_device_time;
    uint32_t damaged;
    int32_t dmabuf_fd; /* a descriptor of the same memory, the driver's; -1: none. Not to be closed */
} burin_image;

typedef struct burin_captured_frame {
    uint32_t struct_size; /* sizeof(burin_captured_frame), set by the caller */
    uint32_t imu_count;
    int64_t t_ns; /* of the depth image (of infrared or colour where there is no depth) */
    burin_image images[BURIN_STREAMS]; /* by burin_stream: the ones nearest in time to it */
    const burin_imu_sample* imu;       /* readings as burin_frame wants them, on the clock of t_ns */
} burin_captured_frame;

/* The next frame; all its pointers hold until the next call of this, burin_source_stop or burin_source_close.
 * timeout_ns >= 0; 0 only looks. Errors: TIMEOUT; DISCONNECTED: unplugged and not back within timeout_ns
 * (with `reconnect`, call again); ENDED; STATE: not streaming; else what made the source FAILED. */
BURIN_API burin_status burin_source_next(burin_source source, int64_t timeout_ns,
                                         burin_captured_frame* frame);

/* *out for burin_scan or burin_integrate (set its T_world_camera): no image is copied, so it holds as long as
 * *frame. INVALID_ARGUMENT: *frame has no depth image or is not of this source. */
BURIN_API burin_status burin_frame_of_capture(burin_source source, const burin_captured_frame* frame,
                                              burin_frame* out);

/* ---------------------------------------------------------------------------------------------------------
 * controls, statistics */

typedef enum burin_control {
    BURIN_CONTROL_DEPTH_EXPOSURE_US = 0,
    BURIN_CONTROL_DEPTH_GAIN = 1,
    BURIN_CONTROL_DEPTH_AUTO_EXPOSURE = 2, /* 0 or 1 */
    BURIN_CONTROL_LASER_POWER_MW = 3,
    BURIN_CONTROL_EMITTER = 4, /* 0 or 1 */
    BURIN_CONTROL_COLOUR_EXPOSURE_US = 5,
    BURIN_CONTROL_COLOUR_GAIN = 6,
    BURIN_CONTROL_COLOUR_AUTO_EXPOSURE = 7, /* 0 or 1 */
    BURIN_CONTROL_MIRROR = 8,               /* 0 or 1 */
    BURIN_CONTROL_CLOSE_RANGE = 9           /* 0 or 1 */
} burin_control;

typedef struct burin_control_range {
    double value, least, most, step, normal; /* normal: the device's default */
} burin_control_range;

/* At any time between open and close. control: a burin_control. UNSUPPORTED: this device has no such control.
 */
BURIN_API burin_status burin_source_get(burin_source source, uint32_t control, burin_control_range* range);
BURIN_API burin_status burin_source_set(burin_source source, uint32_t control, double value);

typedef struct burin_stream_counts {
    uint64_t captured, delivered;
    uint64_t lost;    /* gaps in the sequence of the device or its driver */
    uint64_t damaged; /* parts missing, error flags, broken packets */
    uint64_t dropped; /* here, because newer ones won */
} burin_stream_counts;

typedef struct burin_source_statistics {
    uint32_t struct_size; /* sizeof(burin_source_statistics), set by the caller */
    uint32_t state;       /* a burin_source_state */
    burin_stream_counts streams[BURIN_STREAMS];
    uint64_t frames, reconnects, restarts;
    uint64_t ring_bytes; /* memory for images */
    /* Of the last 256 frames. wait: from the last byte's arrival until burin_source_next had it. delay: from
     * the device's stamp until the last byte's arrival, above the least there was. */
    double wait_p50_ms, wait_p95_ms, wait_max_ms;
    double delay_p50_ms, delay_p95_ms, delay_max_ms;
    double drift_ppm; /* how much faster than the host's the device's clock runs */
} burin_source_statistics;

BURIN_API burin_status burin_source_stats(burin_source source, burin_source_statistics* statistics);

/* ---------------------------------------------------------------------------------------------------------
 * recordings (docs/recording.md): burin_source_open("replay:DIR") plays them, burin scan and burin fuse take
 * them as data sets; both bit for bit what was recorded */

/* A value; {0, 0} is the null recorder. At most 16 at a time. */
typedef struct burin_recorder {
    uint32_t index, generation;
} burin_recorder;

typedef enum burin_recorded_colour {
    BURIN_RECORDED_JPEG = 0,     /* smallest; not what the sensor sent to the bit */
    BURIN_RECORDED_LOSSLESS = 1, /* compressed without loss */
    BURIN_RECORDED_RAW = 2
} burin_recorded_colour;

typedef struct burin_recorder_options {
    uint32_t struct_size; /* sizeof(burin_recorder_options) */
    uint32_t lossless; /* 1: burin_recorder_add waits for room. Default 0: a frame that finds none is dropped,
                          counted */
    uint32_t queue_frames; /* that may wait for the disk, 1 .. 256. Default 15 */
    uint32_t colour;       /* a burin_recorded_colour. Default JPEG */
    uint32_t jpeg_quality; /* 1 .. 100. Default 90 */
    double
        sync_s; /* the disk is made to hold what was written every so long; 0: only at the end. Default 2 */
    uint64_t reserved[4]; /* zero */
} burin_recorder_options;

BURIN_API burin_recorder_options burin_recorder_options_default(void);

/* A new recording of the source's frames in `folder`, which is made when its parent is there. Killed at any
 * byte, the file opens to its last whole record. options may be NULL. Errors: INVALID_ARGUMENT, IO (there is
 * one already, or the disk refuses), INSUFFICIENT_MEMORY, STATE (the source; 16 recorders are open). */
BURIN_API burin_status burin_recorder_open(burin_source source, const char* folder,
                                           const burin_recorder_options* options, burin_recorder* recorder);
/* Copies a frame of that source and returns; a thread of the recorder writes. The source may be used and
 * closed meanwhile. OK also for a frame that is dropped. IO: a full disk, or another refusal, has ended the
 * recording. */
BURIN_API burin_status burin_recorder_add(burin_recorder recorder, const burin_captured_frame* frame);
/* Writes what waits and ends the file; statistics remain, further frames are refused with STATE. The first
 * error of the recording, if any. */
BURIN_API burin_status burin_recorder_finish(burin_recorder recorder);
/* The same, and *recorder becomes the null recorder, also on error. */
BURIN_API burin_status burin_recorder_close(burin_recorder* recorder);
/* As burin_source_error; of the null recorder the line of burin_recorder_open and burin_recorder_close. */
BURIN_API const char* burin_recorder_error(burin_recorder recorder);

typedef struct burin_recorder_statistics {
    uint32_t struct_size;       /* sizeof(burin_recorder_statistics), set by the caller */
    uint32_t disk_full, failed; /* 1: the recording has ended, for this or another refusal of the disk */
    uint32_t queue_high_water;  /* frames */
    uint64_t frames, dropped;
    uint64_t file_bytes, image_bytes,
        coded_bytes; /* the file's; of its images before and after compression */
    uint64_t imu_samples;
    double write_p50_ms, write_p95_ms, write_max_ms; /* to code and write one, of the last 256 */
} burin_recorder_statistics;

BURIN_API burin_status burin_recorder_stats(burin_recorder recorder, burin_recorder_statistics* statistics);

#ifdef __cplusplus
}
#endif

#endif
