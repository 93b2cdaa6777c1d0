/* SPDX-License-Identifier: MIT
 *
 * Burin: depth frames in, a coloured surface out, inside a byte budget.
 *
 *     burin_config config = burin_config_default();
 *     config.budget_bytes = 64u << 20;
 *     uint64_t bytes;  burin_bytes(&config, &bytes);
 *     burin_map map;   burin_create(&config, aligned_alloc(4096, bytes), bytes, &map);
 *     for each frame:  burin_integrate(map, &frame, &result);
 *     burin_mesh_size(map, &options, &vertices, &triangles);   ... buffers ...   burin_mesh(map, &options,
 * &mesh); burin_destroy(&map);
 *
 * Conventions, everywhere in this header
 *   units     metres, seconds only where said, time stamps in int64 nanoseconds
 *   frames    right-handed; camera axes x right, y down, z forward (OpenCV); T_a_b maps coordinates of b to a
 *   pose      unit quaternion x y z w and a translation
 *   pixels    pixel centres at integer coordinates; images are rows of `stride_bytes`
 *   memory    the caller owns every buffer; the library allocates nothing after burin_create (but for
 *             stdio's buffer while burin_save, burin_load or burin_file_probe have a file open)
 *   errors    every call returns a burin_status; a call that fails changes nothing unless it says so.
 *             burin_last_error(map) holds one line with the value and what was expected
 *   threads   one map is used by one thread at a time, any one; a second is refused with STATE. Different
 *             maps are independent; functions without a map may be called on any thread
 *   sizes     structures with a struct_size are refused (INVALID_ARGUMENT) unless it is that of this header:
 *             neither an older nor a newer one half works
 */
#ifndef BURIN_BURIN_H
#define BURIN_BURIN_H

#include <stdint.h>

#if defined(_WIN32)
#define BURIN_API __declspec(dllexport)
#elif defined(__GNUC__)
#define BURIN_API __attribute__((visibility("default")))
#else
#define BURIN_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef enum burin_status {
    BURIN_OK = 0,
    BURIN_INVALID_ARGUMENT = -1,    /* a value is out of its stated range */
    BURIN_INSUFFICIENT_MEMORY = -2, /* too few bytes or too small a buffer; the needed number is reported */
    BURIN_IO = -3,                  /* the operating system refused: missing file, full disk */
    BURIN_FORMAT = -4,              /* a file is damaged or is no map of a version this library reads */
    BURIN_STATE = -5,       /* null, stale or destroyed handle, or a call that does not fit the state */
    BURIN_UNSUPPORTED = -6, /* valid, but not in this build */
    BURIN_CANCELLED = -7,   /* a callback asked to stop */
    /* of capture.h only */
    BURIN_TIMEOUT = -8,      /* nothing came before the deadline */
    BURIN_DISCONNECTED = -9, /* the device is gone */
    BURIN_BUSY = -10,        /* another program or driver has the device */
    BURIN_DENIED = -11,      /* no permission to open the device; the text says what to do */
    BURIN_ENDED = -12        /* a recorded source has no more frames */
} burin_status;

/* A static English word for the status, never NULL. */
BURIN_API const char* burin_strerror(burin_status status);

/* "major.minor.patch", static. */
BURIN_API const char* burin_version(void);

/* The kernels in use on this machine, e.g. "scalar"; static. */
BURIN_API const char* burin_simd_name(void);

/* ----------------------------------------------------------------------------------------------
 * configuration */

typedef enum burin_truncation {
    BURIN_TRUNCATION_CONSTANT = 0, /* truncation_voxels voxels at every depth (KinectFusion) */
    BURIN_TRUNCATION_QUADRATIC = 1 /* truncation_scale * (0.0019 z^2 + 0.00152 z + 0.001504) metres (Chisel
                                      2015), never below truncation_voxels voxels */
} burin_truncation;

typedef enum burin_truncation_along {
    BURIN_TRUNCATION_ALONG_AXIS = 0, /* distances are depth - z (KinectFusion) */
    BURIN_TRUNCATION_ALONG_RAY = 1   /* distances along the viewing ray (Curless & Levoy, Open3D): off the
                                        axis the band is narrower in z */
} burin_truncation_along;

typedef enum burin_weight {
    BURIN_WEIGHT_CONSTANT = 0,  /* 1 for every observation */
    BURIN_WEIGHT_INVERSE_Z2 = 1 /* (1 m / z)^2, between 1/64 and 4: the inverse of a stereo sensor's noise */
} burin_weight;

typedef enum burin_drop { /* the weight behind the surface (Bylow 2013), full down to one voxel behind it */
                          BURIN_DROP_NONE = 0,
                          BURIN_DROP_LINEAR = 1, /* linear to 0 at the truncation distance */
                          BURIN_DROP_EXPONENTIAL =
                              2 /* exp(-5 x^2), x = 0 at one voxel behind, 1 at the truncation distance */
} burin_drop;

typedef enum burin_tracker {
    BURIN_TRACKER_NONE = 0, /* poses come with the frames: burin_integrate */
    BURIN_TRACKER_SDF =
        1, /* burin_scan aligns depth with the signed distance field (Bylow et al., RSS 2013) */
    BURIN_TRACKER_ICP = 2 /* burin_scan aligns depth with a raycast of the map (KinectFusion 2011) */
} burin_tracker;

/* Fill with burin_config_default() or burin_scan_config_default(), then change what you need. */
typedef struct burin_config {
    uint32_t struct_size; /* sizeof(burin_config), set by burin_config_default */
    uint32_t version;     /* BURIN_CONFIG_VERSION, set by burin_config_default */
    uint64_t
        budget_bytes; /* everything the map may use; the number of chunks follows from it. Default 256 MiB */
    float voxel_m;    /* edge of a voxel, 0.0005 .. 1. Default 0.005 */
    float truncation_voxels; /* truncation distance in voxels, 2 .. 32. Default 4 */
    uint32_t truncation;     /* a burin_truncation. Default constant */
    float truncation_scale;  /* of the quadratic model, 1 .. 32. Default 8 (OpenChisel) */
    float min_depth_m;       /* nearer readings are ignored, >= 0.01. Default 0.2 */
    float max_depth_m;       /* farther readings are ignored, <= 50. Default 4 */
    uint32_t weight;         /* a burin_weight. Default constant */
    uint32_t drop;           /* a burin_drop. Default none: with a sensor noise near the
                                truncation the others pull the surface to the camera */
    uint32_t angle_weight;   /* 1: times the cosine between viewing ray and surface normal. Default 0 */
    float max_weight; /* the running average forgets beyond this many observations, 1 .. 1000. Default 255 */
    uint32_t carve;   /* 1: chunks seen through are pulled to free space (Chisel). Default 1 */
    uint32_t colour;  /* 1: room for colour (doubles a chunk). Default 1 */
    uint32_t bilateral;    /* 1: smooth each depth image, edges kept. Default 0 */
    uint32_t edge_removal; /* 1: drop readings that lie on a jump in depth (flying pixels). Default 0 */
    uint32_t max_width;    /* largest depth image that will be given. Default 640 x 480 */
    uint32_t max_height;
    uint32_t threads; /* worker threads counting the caller, 1 .. 64. Default 1. Their stacks are not in the
                         budget. The map does not depend on it */
    uint32_t truncation_along; /* a burin_truncation_along: how signed distances are measured. Default axis */
    uint32_t store_chunks; /* > 0: burin_store_open will be called; room to know so many chunks (of the whole
                              map) by their place in the file, 36 bytes of the budget each, and 0.4 MiB for
                              buffers; at most 2^27. One more thread does the writing. Default 0 */
    uint32_t tracker;      /* a burin_tracker; its memory, some 3 MiB, is in the budget. Default none */
    uint32_t track_colour; /* 1: also by brightness against keyframes, where frames have colour. Default 1 */
    uint32_t track_gyro;   /* 1: also by the gyroscope, where frames have samples. Default 1 */
    uint32_t planes;       /* 1: planes are found and the surface joins them (docs/planes.md); takes 5 MiB
                                    and a fifth to a third of the rest of the budget. Default 0 */
    uint32_t reserved[2];  /* zero */
} burin_config;

#define BURIN_CONFIG_VERSION 1u

BURIN_API burin_config burin_config_default(void);
/* The same for burin_scan: tracker SDF; a truncation of 8 voxels, since a pose further off than that finds no
 * gradient; bilateral and edge_removal 1, weight by 1 / z^2: what tracks best on the sequences of
 * docs/tracking.md. */
BURIN_API burin_config burin_scan_config_default(void);

/* The exact number of bytes burin_create will use for this configuration: at most budget_bytes, short of it
 * by less than one chunk with its share of the tables. *bytes is set only on success. Errors:
 * INVALID_ARGUMENT (a field out of range), INSUFFICIENT_MEMORY (the budget holds no 64 chunks; the text in
 * burin_last_error((burin_map){0}) tells the least budget). */
BURIN_API burin_status burin_bytes(const burin_config* config, uint64_t* bytes);

/* ------------------------------------------------------------------------------------------------- life of a
 * map */

/* A value; {0, 0} is the null map. A destroyed map's handle is recognised as stale. */
typedef struct burin_map {
    uint32_t index;
    uint32_t generation;
} burin_map;

/* memory: at least burin_bytes(config) bytes, aligned to 64, untouched by the caller until burin_destroy. It
 * need not be zeroed. *map is set only on success. Errors (in burin_last_error((burin_map){0})):
 * INVALID_ARGUMENT (null, misaligned, a field out of range), INSUFFICIENT_MEMORY (the text says how many
 * bytes), STATE (64 maps exist in this process already). */
BURIN_API burin_status burin_create(const burin_config* config, void* memory, uint64_t bytes, burin_map* map);

/* Stops the threads and nulls the handle; the memory is the caller's again. A null map is fine. Errors: STATE
 * (stale, or in use: also from one of its own callbacks); the map then stays. */
BURIN_API burin_status burin_destroy(burin_map* map);

/* Forgets every chunk; the configuration stays. */
BURIN_API burin_status burin_reset(burin_map map);

/* One line about the last call on this map that failed, "" if none; for calls without a map pass the null
 * map. Valid until the next failing call. */
BURIN_API const char* burin_last_error(burin_map map);

/* ---------------------------------------------------------------------------------------------------------
 * callbacks */

/* body(context, index) is a piece of work for a thread of the application. */
typedef void (*burin_job)(void* context, uint32_t index);

/* What a map asks of its application. A callback may not call functions on the same map (STATE), and must not
 * throw or jump out. `user` is handed to each. */
typedef struct burin_hooks {
    uint32_t struct_size;  /* sizeof(burin_hooks), set by burin_hooks_default */
    uint32_t pool_threads; /* calls of body that `run` can have under way at a time, 1 .. 64. Default 1 */
    void* user;

    /* How far burin_mesh_size, burin_mesh, burin_raycast, burin_sample, burin_save(_to) or burin_load(_from)
     * is: 0 .. 1, never less than before, up to some thousand times a second. Not 0: stop, and the call soon
     * ends with CANCELLED; the map is as it was (but see burin_load), and buffers of the caller hold nothing
     * of use. At 1 the work is done and the answer is ignored. Called on the calling thread; with `run`, on
     * any of its threads, one at a time. NULL: nobody is told. */
    int (*progress)(void* user, double done);

    /* The application's threads instead of `threads` of burin_config (leave that at 1, so that none are
     * started): call body(context, i) once for every i in 0 .. count - 1, each on any thread, in any order,
     * and return when all of them have returned. count <= pool_threads; a frame has some twenty runs of a few
     * hundred microseconds. Not 0, or bodies left out: their work is done by the calling thread. Results do
     * not depend on any of it. NULL: the map's own threads. */
    int (*run)(void* user, uint32_t count, burin_job body, void* context);

    uint64_t reserved[8]; /* zero */
} burin_hooks;

/* No callbacks. */
BURIN_API burin_hooks burin_hooks_default(void);

/* Copies *hooks into the map; they hold until the next call of this, through burin_reset too. NULL takes them
 * away. Errors: INVALID_ARGUMENT (size, pool_threads, reserved), STATE. */
BURIN_API burin_status burin_set_hooks(burin_map map, const burin_hooks* hooks);

typedef enum burin_log_level {
    BURIN_LOG_ERROR = 0,   /* the line of a call that failed, as in burin_last_error */
    BURIN_LOG_WARNING = 1, /* the first frame of a map that dropped chunks */
    BURIN_LOG_INFO = 2     /* a map was created: chunks, bytes, kernels, threads */
} burin_log_level;

/* `line` has no line end and is valid during the call. */
typedef void (*burin_log)(void* user, burin_log_level level, const char* line);

/* One callback for the process, on whatever thread a call was made; NULL (as at the start): none. May be
 * called at any time; a line that another thread is about to write may still go to the callback before. What
 * the callback itself causes is not logged. */
BURIN_API void burin_set_log(burin_log log, void* user);

/* ---------------------------------------------------------------------------------------------------------
 * frames */

typedef struct burin_camera {
    uint32_t width, height;    /* pixels */
    double fx, fy, cx, cy;     /* pixels */
    double k1, k2, p1, p2, k3; /* Brown's distortion, 0 when the image is rectified */
} burin_camera;

typedef struct burin_pose {
    double tx, ty, tz;     /* metres */
    double qx, qy, qz, qw; /* unit quaternion */
} burin_pose;

typedef enum burin_depth_type {
    BURIN_DEPTH_U16 = 0, /* metres = value * depth_unit_m; 0 and 65535 mean no depth */
    BURIN_DEPTH_F32 = 1  /* metres = value * depth_unit_m; 0, negative, NaN and inf mean no depth */
} burin_depth_type;

/* Bytes of a pixel in memory order, sRGB. All but RGB8 are read pixel by pixel where a voxel wants one, which
 * costs a little time and no memory; the map is that of the same image in RGB8, bit for bit. */
typedef enum burin_pixel_format {
    BURIN_PIXEL_RGB8 = 0,
    BURIN_PIXEL_BGR8 = 1,
    BURIN_PIXEL_RGBA8 = 2, /* alpha is ignored */
    BURIN_PIXEL_BGRA8 = 3,
    BURIN_PIXEL_GREY8 = 4,
    BURIN_PIXEL_YUYV = 5, /* 4:2:2, Y U Y V for two pixels, BT.601, Y of 16..235 (the default of V4L2) */
    BURIN_PIXEL_NV12 = 6, /* 4:2:0, a plane of Y and one of U V pairs, BT.601, Y of 0..255 (JFIF; ARKit) */
    BURIN_PIXEL_NV21 = 7  /* the same with V U pairs (Android) */
} burin_pixel_format;

/* One reading of an inertial sensor, in its own axes. */
typedef struct burin_imu_sample {
    int64_t t_ns;
    double gyro_rad_s[3]; /* angular velocity */
    double accel_m_s2[3]; /* specific force: at rest +9.81 upwards */
} burin_imu_sample;

typedef struct burin_frame {
    uint32_t struct_size; /* sizeof(burin_frame) */
    uint32_t depth_type;  /* a burin_depth_type */
    int64_t t_ns;
    const void* depth;           /* z along the optical axis, depth_camera.height rows */
    uint64_t depth_stride_bytes; /* >= width * sample size, a multiple of the sample size */
    double depth_unit_m;         /* e.g. 0.001 for millimetres */
    burin_camera depth_camera;
    burin_pose T_world_camera;        /* of the depth camera; see burin_scan */
    const uint8_t* confidence;        /* a byte for each depth pixel; NULL when the sensor gives none */
    uint64_t confidence_stride_bytes; /* >= width */
    uint32_t min_confidence;      /* depth of less is ignored, 0 .. 255; ARKit gives 0 1 2, others 0 .. 255 */
    uint32_t colour_format;       /* a burin_pixel_format */
    const uint8_t* colour;        /* colour_camera.height rows; NULL when the frame has no colour */
    uint64_t colour_stride_bytes; /* >= the bytes of a row: width * 3, 4 or 1, of YUYV 4 for two pixels */
    const uint8_t* chroma; /* NV12 and NV21: (height + 1) / 2 rows of (width + 1) / 2 pairs, else NULL */
    uint64_t chroma_stride_bytes; /* >= 2 * ((width + 1) / 2) */
    burin_camera colour_camera;   /* its own size and intrinsics */
    burin_pose T_colour_depth;    /* depth camera coordinates to colour camera coordinates */
    const burin_imu_sample*
        imu;            /* for burin_scan: readings since the previous frame's t_ns, in order of time, up to
                           the first at or after this one's; those not finite are passed over */
    uint32_t imu_count; /* at most 65536 */
    burin_pose T_camera_imu; /* IMU coordinates to depth camera coordinates */
    uint32_t reserved[8];    /* zero */
} burin_frame;

/* Zeroed but for struct_size and identity poses. */
BURIN_API burin_frame burin_frame_default(void);

/* Flags of a frame. */
enum {
    BURIN_FLAG_POOL_FULL = 1,   /* chunks were dropped: raise budget_bytes or voxel_m */
    BURIN_FLAG_STORE_FULL = 2,  /* the disk has no room, or the map more chunks than store_chunks */
    BURIN_FLAG_STORE_FAILED = 4 /* the store could not be written or read back; fusion goes on in memory */
};

typedef struct burin_frame_result {
    uint32_t flags;
    uint32_t chunks_fused; /* chunks that took at least one reading */
    uint32_t chunks_new;
    uint32_t chunks_carved;
    uint32_t chunks_dropped; /* chunks the frame would have added, had there been room */
    uint32_t valid_pixels;   /* depth readings in range */
    double depth_ms, integrate_ms, planes_ms;
} burin_frame_result;

/* Fuses one frame (Curless & Levoy 1996; projective signed distance as in KinectFusion 2011). `result` may be
 * NULL. A full pool is no error: the frame is finished with the chunks there are, see `flags` and
 * `chunks_dropped`. With a store open nothing is dropped unless it is full or fails. Errors leave the map as
 * it was. */
BURIN_API burin_status burin_integrate(burin_map map, const burin_frame* frame, burin_frame_result* result);

/* -------------------------------------------------------------------------------------------------------
 * scanning: the camera is tracked (docs/tracking.md) */

typedef enum burin_tracking_state {
    BURIN_TRACKING_LOST = 0, /* no pose; nothing is fused. Later frames look for the camera near its last pose
                                and at keyframes that look alike (Glocker et al., TVCG 2015) */
    BURIN_TRACKING_WEAK = 1, /* a pose, but some motion is held by the prediction alone, too little fits, or
                                the camera has just been found again; nothing is fused */
    BURIN_TRACKING_OK = 2    /* fused */
} burin_tracking_state;

typedef struct burin_scan_result {
    burin_frame_result fusion; /* chunk counts are 0 when nothing was fused */
    uint32_t state;            /* a burin_tracking_state */
    uint32_t relocalised;      /* 1: the camera was lost before this frame and is found */
    burin_pose T_world_camera; /* of the depth camera; identity when lost */
    uint32_t evaluations;      /* of the alignment, at any level of detail */
    uint32_t free_directions;  /* of the six motions, those that the frame does not hold to 6 mm */
    float weakest_m;      /* standard deviation of the motion that is held least, as arc at the mean depth */
    float known_share;    /* of the frame's points, those in space that the map knows, 0 .. 1 */
    float close_share;    /* of these, those within 1.5 standard deviations of the map's surface */
    float keyframe_share; /* of the points with colour, those that the colour keyframe shows; 0 without one */
    double track_ms;
} burin_scan_result;

/* Finds the frame's pose by itself, and fuses it when the pose is sure. The first frame of an empty map
 * defines the world: it is fused at its T_world_camera (the identity unless set). After burin_load of a map
 * that was saved by a scan the first frames are those of a lost camera. Otherwise T_world_camera is not
 * looked at. `result` may be NULL. Deterministic: the same frames give the same poses, bit for bit, for any
 * number of threads. Errors leave map and camera as they were: STATE (config.tracker is none), and those of
 * burin_integrate. */
BURIN_API burin_status burin_scan(burin_map map, const burin_frame* frame, burin_scan_result* result);

/* The direction against gravity in the world's axes, from accelerometer readings and tracked poses;
 * sigma_rad, may be NULL, is its standard deviation. STATE: not known (no IMU, or less than a second of it).
 */
BURIN_API burin_status burin_up(burin_map map, double up[3], double* sigma_rad);

/* -----------------------------------------------------------------------------------------------------
 * statistics */

typedef struct burin_statistics {
    uint64_t arena_bytes;    /* what burin_bytes said */
    uint64_t frames;         /* integrated since create, reset or the saved map's own beginning */
    uint64_t chunks_dropped; /* summed over frames */
    uint32_t chunks_live, chunks_high_water, chunks_capacity;
    float voxel_m, truncation_m;            /* truncation_m: the distance the stored values are scaled by */
    float bounds_min_m[3], bounds_max_m[3]; /* box around all chunks; min > max when empty */
    uint64_t chunks_evicted,
        chunks_reloaded;    /* to and from the store, since it was opened or the map reset */
    uint64_t store_bytes;   /* length of its file, 0 without one */
    uint32_t chunks_stored; /* chunks of the map that are in the store alone */
    int32_t store_error;    /* errno of what the disk refused last, 0 while it is well */
} burin_statistics;

/* Walks over the keys of all chunks. Errors: INVALID_ARGUMENT (null), STATE. */
BURIN_API burin_status burin_stats(burin_map map, burin_statistics* statistics);

/* A 64-bit digest of every chunk's key and voxels, in key order: equal maps have equal hashes, whatever the
 * budget, the threads or the machine. */
BURIN_API burin_status burin_hash(burin_map map, uint64_t* hash);

/* ---------------------------------------------------------------------------------------------------------
 * meshes */

typedef struct burin_mesh_options {
    uint32_t struct_size;  /* sizeof(burin_mesh_options) */
    float min_weight;      /* voxels with less are unknown. Default 0.5: one reading, not far behind */
    float max_jump_voxels; /* an edge of a cell whose two distances differ by more is no surface (the back of
                              a silhouette), >= 1.8. Default 7: surface seen at up to 81 degrees stays */
} burin_mesh_options;

BURIN_API burin_mesh_options burin_mesh_options_default(void);

/* Caller buffers; any but positions and triangles may be NULL. */
typedef struct burin_mesh_buffers {
    uint64_t vertex_capacity, triangle_capacity;
    float* positions;                      /* 3 per vertex */
    float* normals;                        /* 3 per vertex, unit, towards free space */
    uint8_t* colours;                      /* 3 per vertex, sRGB; 255 255 255 where no colour was seen */
    uint32_t* triangles;                   /* 3 per triangle, counter-clockwise seen from free space */
    uint64_t vertex_count, triangle_count; /* out */
} burin_mesh_buffers;

/* The sizes burin_mesh needs now, and as long as the map does not change. options: NULL for the defaults.
 * Errors: INVALID_ARGUMENT, STATE, CANCELLED; the counts are then untouched. */
BURIN_API burin_status burin_mesh_size(burin_map map, const burin_mesh_options* options, uint64_t* vertices,
                                       uint64_t* triangles);

/* The surface of the whole map by marching cubes. Vertices are shared within and across chunks.
 * Errors: INSUFFICIENT_MEMORY (a capacity is too small; the counts then hold what is needed),
 * INVALID_ARGUMENT, UNSUPPORTED (more than 2^32 - 2 vertices), STATE, CANCELLED. */
BURIN_API burin_status burin_mesh(burin_map map, const burin_mesh_options* options, burin_mesh_buffers* mesh);

typedef struct burin_chunk_key {
    int32_t x, y, z; /* chunk (x,y,z) spans [8 x voxel_m, 8 (x + 1) voxel_m) and so on */
} burin_chunk_key;

/* Which chunks are worth meshing again (docs/mesh.md). */
typedef struct burin_change_options {
    uint32_t struct_size;   /* sizeof(burin_change_options) */
    float threshold_voxels; /* a chunk whose surface moved by less since it was last meshed keeps its mesh,
                               but for every eighth turn. >= 0; 0: every change counts. Default 0.05 */
    uint32_t interval; /* a chunk has its turn every so many frames, 1 .. 65535; when it is meshed for the
                          first time it does not wait. Default 64 */
} burin_change_options;

BURIN_API burin_change_options burin_change_options_default(void);

/* The chunks to be meshed (again) by burin_chunk_mesh or burin_chunk_meshes after this frame, in key order; a
 * chunk stays in the list until it is meshed. With the default options about as much work every frame,
 * however noisy the depth. With threshold_voxels 0 and interval 1: every chunk whose mesh differs in any bit,
 * as after the last frame. With planes also chunks that these complete where the map has none, after each
 * burin_refresh_planes. options may be NULL. INSUFFICIENT_MEMORY: *count holds the needed capacity. */
BURIN_API burin_status burin_changed_chunks(burin_map map, const burin_change_options* options,
                                            burin_chunk_key* keys, uint64_t capacity, uint64_t* count);
/* The same with the default options. */
BURIN_API burin_status burin_dirty_chunks(burin_map map, burin_chunk_key* keys, uint64_t capacity,
                                          uint64_t* count);

/* The surface inside one chunk's cells; vertices on the border are repeated, bit for bit, by the neighbour.
 * At most 1944 vertices and 2560 triangles. The chunk leaves the list of changed ones. A chunk that is not
 * there gives an empty mesh. */
BURIN_API burin_status burin_chunk_mesh(burin_map map, burin_chunk_key key, const burin_mesh_options* options,
                                        burin_mesh_buffers* mesh);

/* Where the mesh of one chunk lies in the buffers of burin_chunk_meshes. Its triangles count its own
 * vertices, from 0: what renderers call a base vertex is first_vertex. */
typedef struct burin_mesh_range {
    uint64_t first_vertex, vertex_count, first_triangle, triangle_count;
} burin_mesh_range;

/* burin_chunk_mesh of keys[0] .. keys[count - 1], one behind the other, by all threads of the map: as many of
 * the first ones as fit the buffers. *done tells how many, ranges[i] where each lies, and mesh's counts their
 * sum; only those leave the list of changed chunks. The bytes are the same for any number of threads. Fewer
 * than `count` is no error; when not even the first fits (INSUFFICIENT_MEMORY), the counts hold what it
 * needs. INVALID_ARGUMENT: a null pointer, or a key out of range among them; nothing is meshed then. */
BURIN_API burin_status burin_chunk_meshes(burin_map map, const burin_chunk_key* keys, uint64_t count,
                                          const burin_mesh_options* options, burin_mesh_buffers* mesh,
                                          burin_mesh_range* ranges, uint64_t* done);

/* What burin_scan_beside does on another thread of the map while its frame is tracked. */
typedef struct burin_beside {
    uint32_t struct_size;
    const burin_frame* next; /* the frame of the next call, or NULL: its depth image is prepared. It and its
                              * pixels must stay as they are until that call */
    const burin_chunk_key* keys; /* chunks for burin_chunk_meshes, as the frame before left them */
    uint64_t key_count;          /* 0: none; then what follows may be NULL */
    const burin_mesh_options* mesh_options;
    burin_mesh_buffers* mesh;
    burin_mesh_range* ranges;
    uint64_t meshed; /* out: as *done of burin_chunk_meshes */
    double mesh_ms;  /* out: the time that took, beside the tracking */
} burin_beside;

/* burin_scan, and beside it what belongs to the frames before and after: the threads of the map wait less for
 * one another. Poses, map and meshes are bit for bit those of burin_chunk_meshes followed by burin_scan. On
 * return all is done. result->fusion.depth_ms is the time that the frame's depth image took, also where that
 * was during the call before. Errors before anything is done: those of burin_scan (also of beside->next) and
 * of burin_chunk_meshes; INSUFFICIENT_MEMORY of the latter comes when the frame has been taken in. */
BURIN_API burin_status burin_scan_beside(burin_map map, const burin_frame* frame, burin_beside* beside,
                                         burin_scan_result* result);

/* Removes connected components of fewer than min_triangles triangles, in place; what stays keeps its order,
 * and the counts are updated. scratch: 2 * mesh->vertex_count uint32_t. Needs no map. */
BURIN_API burin_status burin_mesh_remove_small(burin_mesh_buffers* mesh, uint64_t min_triangles,
                                               uint32_t* scratch);

/* --------------------------------------------------------------------------------------------------------
 * planes: Dzitsiuk et al., ICRA 2017 (docs/planes.md). All need config.planes, else STATE */

/* Of planes and faces, as in PLY files. */
typedef enum burin_label {
    BURIN_LABEL_NONE = 0,
    BURIN_LABEL_WALL = 1,
    BURIN_LABEL_FLOOR = 2,
    BURIN_LABEL_CEILING = 3,
    BURIN_LABEL_TABLE = 4,
    BURIN_LABEL_SEAT = 5,
    BURIN_LABEL_WINDOW = 6,
    BURIN_LABEL_DOOR = 7
} burin_label;

typedef struct burin_plane {
    uint32_t id;              /* 1, 2, ...; stays with the plane, and is never used for another */
    uint32_t label;           /* a burin_label, as of the last burin_refresh_planes */
    double normal[3], offset; /* normal . x + offset = 0, metres; unit, into free space */
    double covariance[16];    /* 4x4, row-major, of (normal, offset) */
    double area_m2;           /* of the surface seen */
    double rms_m;             /* distance of the fused surface to the plane, before it is drawn to it */
    uint32_t support;         /* chunks that hold some of it */
    uint32_t reserved;
} burin_plane;

/* Brings everything about planes up to date with the map: every chunk that changed since its turn, planes
 * joined and founded until nothing changes, the surface drawn to them. Between calls each frame does a share
 * of this by itself, within a bounded time. Takes some 10 us for every chunk of surface. Errors: STATE,
 * CANCELLED. */
BURIN_API burin_status burin_refresh_planes(burin_map map);

/* The planes of at least 0.1 m^2, in order of id. INSUFFICIENT_MEMORY: *count holds the needed capacity. */
BURIN_API burin_status burin_planes(burin_map map, burin_plane* planes, uint64_t capacity, uint64_t* count);

typedef enum burin_plane_change {
    BURIN_PLANE_ADDED = 0,
    BURIN_PLANE_CHANGED = 1, /* its equation moved by more than 1/25 voxel somewhere on it */
    BURIN_PLANE_MERGED = 2,  /* into another; its id is gone */
    BURIN_PLANE_REMOVED = 3
} burin_plane_change;

typedef struct burin_plane_event {
    uint32_t change; /* a burin_plane_change */
    uint32_t id;
    uint32_t into; /* of merged: the plane that goes on; else 0 */
} burin_plane_event;

/* What happened to planes (also those too small to be told) since the last call, oldest first; what is handed
 * out is forgotten. *count: how many. *lost, may be NULL: how many more there were that found no room in the
 * map (1024), told once. */
BURIN_API burin_status burin_plane_events(burin_map map, burin_plane_event* events, uint64_t capacity,
                                          uint64_t* count, uint64_t* lost);

/* For each triangle of a mesh of this map: its label, the id of its plane (0 for none), and 1 where nobody
 * saw it and a plane was completed; each may be NULL. mesh: positions, triangles and their counts; indices
 * below vertex_count. Errors: INVALID_ARGUMENT, STATE, CANCELLED. */
BURIN_API burin_status burin_label_faces(burin_map map, const burin_mesh_buffers* mesh, uint8_t* labels,
                                         uint32_t* plane_ids, uint8_t* filled);

/* The outline of a plane on it: rings of points (3 doubles each, world, metres), counter-clockwise seen from
 * free space around what belongs to it, clockwise around holes. Of what was seen, or with completed not 0
 * also of what the last burin_refresh_planes completed. Ring r begins at point ring_starts[r] and goes to the
 * next ring's. Accurate to some three voxels. INVALID_ARGUMENT: no such id. INSUFFICIENT_MEMORY: *count and
 * *rings hold what is needed. */
BURIN_API burin_status burin_plane_outline(burin_map map, uint32_t id, uint32_t completed, double* points,
                                           uint64_t capacity, uint64_t* count, uint32_t* ring_starts,
                                           uint64_t ring_capacity, uint64_t* rings);

/* The first plane that a ray meets within max_m, from its free side, where it was seen or completed: *id, 0
 * for none, and the distance (max_m for none). direction: unit. Errors: INVALID_ARGUMENT, STATE. */
BURIN_API burin_status burin_plane_hit(burin_map map, const double origin[3], const double direction[3],
                                       double max_m, uint32_t* id, double* distance_m);

/* Labels need to know where up is. With an IMU that tells (burin_up); else as told here (unit, world; until
 * burin_reset); else from the planes and the cameras of frames fused since create or load; else z. */
BURIN_API burin_status burin_set_up(burin_map map, const double up[3]);

/* The direction against gravity that the labels of the last burin_refresh_planes are by. */
BURIN_API burin_status burin_planes_up(burin_map map, double up[3]);

/* A thing that stands, lies or hangs: what is left of the mesh in one piece without floor, walls, ceiling,
 * tables, doors and windows. */
typedef struct burin_object {
    float min[3], max[3]; /* its box along the world's axes, metres */
    double area_m2;       /* of its faces */
    uint64_t faces;
    uint32_t label;        /* BURIN_LABEL_SEAT: one can sit on it (0.05 m^2 of it are seat); else NONE */
    uint32_t first_vertex; /* the least of its vertices: tells objects apart while the mesh stays */
} burin_object;

/* The objects of a mesh of this map (positions, triangles and their counts; every vertex once, as burin_mesh
 * writes it), largest area first. face_labels: one a triangle, as burin_label_faces tells them; the planes
 * are those of the last burin_refresh_planes. scratch: 2 * mesh->vertex_count + mesh->triangle_count
 * uint32_t. face_objects, may be NULL: of each triangle the index of its object, UINT32_MAX for none. Takes
 * time in triangles times planes. INSUFFICIENT_MEMORY: the largest were looked at alone, *count holds a
 * capacity that suffices. Errors: INVALID_ARGUMENT, STATE. */
BURIN_API burin_status burin_mesh_objects(burin_map map, const burin_mesh_buffers* mesh,
                                          const uint8_t* face_labels, uint32_t* scratch,
                                          burin_object* objects, uint64_t capacity, uint64_t* count,
                                          uint32_t* face_objects);

/* --------------------------------------------------------------------------------------------------------
 * queries */

/* What a camera at T_world_camera would see, by ray casting (KinectFusion 2011, section 3.3). Buffers of
 * camera.width * camera.height pixels, packed; each may be NULL. No surface: depth 0, normal 0 0 0, colour 0
 * 0 0. Errors: UNSUPPORTED (the camera has distortion), INVALID_ARGUMENT (camera, pose), STATE; buffers are
 * then untouched; CANCELLED. */
BURIN_API burin_status burin_raycast(burin_map map, const burin_camera* camera,
                                     const burin_pose* T_world_camera, float* depth_m, float* normals,
                                     uint8_t* rgb);

/* Signed distance (metres, + in free space) at `count` world points (3 doubles each), trilinear; NaN where a
 * voxel around the point was never seen. gradients (3 floats a point, unitless) may be NULL. Errors:
 * INVALID_ARGUMENT (null, 2^42 points or more), STATE, CANCELLED. */
BURIN_API burin_status burin_sample(burin_map map, const double* points, uint64_t count, float* distances,
                                    float* gradients);

/* ----------------------------------------------------------------------------------------------------------
 * files */

/* Writes the map (docs/map_file.md) to `path`: first to `path`.part, which replaces `path` only when
 * complete. Errors: IO, CANCELLED; what stood under `path` is then untouched. stdio allocates while the file
 * is open; burin_save_to does not. */
BURIN_API burin_status burin_save(burin_map map, const char* path);

/* Take `bytes` bytes, the next ones of the map: pieces of 2 or 4 KiB, in order. Not 0: it failed, and the
 * call ends with IO. */
typedef int (*burin_write)(void* user, const void* data, uint64_t bytes);

/* Put exactly the next `bytes` bytes of a saved map at `data`. Not 0: it failed or there are no more, and the
 * call ends with IO. */
typedef int (*burin_read)(void* user, void* data, uint64_t bytes);

/* The same bytes as burin_save, to a callback. Errors: IO (the callback failed), CANCELLED; what was written
 * by then is no map, which burin_load_from notices. The callback runs on the calling thread. */
BURIN_API burin_status burin_save_to(burin_map map, burin_write write, void* user);

typedef struct burin_file_info {
    uint32_t version, has_colour;
    float voxel_m, truncation_m;
    uint64_t chunks, frames, hash;
    burin_config config;         /* as it was when saved */
    uint64_t least_budget_bytes; /* with config as saved, the smallest budget that holds the map */
} burin_file_info;

/* Reads only the head of a map file. */
BURIN_API burin_status burin_file_probe(const char* path, burin_file_info* info);

/* The same from a callback that gives the first 4096 bytes of a map. */
BURIN_API burin_status burin_probe_from(burin_read read, void* user, burin_file_info* info);

/* Replaces the map's chunks by those of the file. The voxel, the truncation and the presence of colour must
 * be those of the map's configuration (INVALID_ARGUMENT). INSUFFICIENT_MEMORY: the text tells the budget it
 * takes. On failure after the head was read (FORMAT: a damaged chunk, IO, CANCELLED) the map is empty: there
 * is no room for two. Before that it is as it was. */
BURIN_API burin_status burin_load(burin_map map, const char* path);

/* The same from a callback, which is asked for the bytes of the map and no more: other things may follow in
 * the same stream. It runs on the calling thread. */
BURIN_API burin_status burin_load_from(burin_map map, burin_read read, void* user);

/* ----------------------------------------------------------------------------------------------------------
 * the store: a file for the chunks that find no room in memory (docs/store.md) */

typedef enum burin_store_mode {
    BURIN_STORE_NEW = 0,   /* `path` must not exist; the map stays as it is */
    BURIN_STORE_RESUME = 1 /* the map becomes that of the file's last commit */
} burin_store_mode;

/* Attaches a store to a map whose configuration has store_chunks; it stays until burin_destroy. From then on
 * a frame that finds the pool full sends the chunks farthest from its view to the file, and a frame that
 * would change chunks of the file brings them back: the map is bit for bit the one that a larger budget would
 * have held. burin_integrate may then wait for the disk. burin_hash, burin_save, burin_chunks,
 * burin_chunk_mesh and burin_chunk_meshes cover the whole map; burin_mesh, burin_raycast and burin_sample
 * what is in memory. Errors: STATE (store_chunks is 0, or a store is open), IO, FORMAT (damaged),
 * INVALID_ARGUMENT (a store of other voxels), INSUFFICIENT_MEMORY (more chunks than store_chunks). */
BURIN_API burin_status burin_store_open(burin_map map, const char* path, uint32_t mode);

/* Writes what has changed and waits until the disk has it: whatever happens to the process or the machine
 * later, BURIN_STORE_RESUME gives the map as it is now or as a later commit has it. IO: the disk refused (it
 * may be tried again); the earlier commit stands. */
BURIN_API burin_status burin_store_commit(burin_map map);

/* The keys of all chunks of the map, in key order. INSUFFICIENT_MEMORY: *count holds the needed capacity. */
BURIN_API burin_status burin_chunks(burin_map map, burin_chunk_key* keys, uint64_t capacity, uint64_t* count);

#ifdef __cplusplus
}
#endif
#endif
