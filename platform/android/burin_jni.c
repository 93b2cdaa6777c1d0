/* SPDX-License-Identifier: MIT
 *
 * The native half of burin.BurinMap: burin.h for Java. Only the C interface is used. A handle is the address
 * of a Holder; Java keeps it from being used after close(). */
#include <burin/burin.h>
#include <jni.h>
#include <stdlib.h>
#include <string.h>

#ifdef BURIN_JNI_HEADER /* what javac -h says of BurinMap.java; the compiler compares */
#include BURIN_JNI_HEADER
#endif

typedef struct Holder {
    burin_map map;
    void* memory;
} Holder;

static Holder* holder_of(jlong handle) { return (Holder*)(intptr_t)handle; }

static void throw_new(JNIEnv* env, burin_status status, const char* text) {
    jclass type = (*env)->FindClass(env, "burin/BurinException");
    jmethodID make = type ? (*env)->GetMethodID(env, type, "<init>", "(ILjava/lang/String;)V") : NULL;
    jstring message = make ? (*env)->NewStringUTF(env, text) : NULL;
    jobject exception = message ? (*env)->NewObject(env, type, make, (jint)status, message) : NULL;
    if (exception) (*env)->Throw(env, (jthrowable)exception);
}

/* Whether the call went well; otherwise an exception is on its way. */
static int ok(JNIEnv* env, burin_map map, burin_status status) {
    if (status == BURIN_OK) return 1;
    const char* text = burin_last_error(map);
    throw_new(env, status, *text ? text : burin_strerror(status));
    return 0;
}

/* A direct buffer of at least `bytes`; NULL with an exception on its way. */
static void* direct(JNIEnv* env, jobject buffer, uint64_t bytes, const char* name) {
    void* data = buffer ? (*env)->GetDirectBufferAddress(env, buffer) : NULL;
    const jlong capacity = data ? (*env)->GetDirectBufferCapacity(env, buffer) : -1;
    if (capacity >= 0 && (uint64_t)capacity >= bytes) return data;
    throw_new(env, BURIN_INVALID_ARGUMENT, name);
    return NULL;
}

/* `count` doubles of an array; 0 with an exception on its way. */
static int doubles(JNIEnv* env, jdoubleArray array, jsize count, double* out, const char* name) {
    if (array && (*env)->GetArrayLength(env, array) == count) {
        (*env)->GetDoubleArrayRegion(env, array, 0, count, out);
        return 1;
    }
    throw_new(env, BURIN_INVALID_ARGUMENT, name);
    return 0;
}

static burin_pose pose_of(const double* p) {
    const burin_pose pose = {p[0], p[1], p[2], p[3], p[4], p[5], p[6]};
    return pose;
}
static burin_camera camera_of(jint width, jint height, const double* c) {
    const burin_camera camera = {
        (uint32_t)width, (uint32_t)height, c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8]};
    return camera;
}
/* From the first byte to the last one that is read; 0 for numbers that burin_integrate itself refuses. */
static uint64_t image_bytes(jint width, jint height, jint stride, uint64_t pixel) {
    if (width <= 0 || height <= 0 || stride <= 0) return 0;
    return (uint64_t)stride * (uint64_t)(height - 1) + pixel * (uint64_t)width;
}

JNIEXPORT jstring JNICALL Java_burin_BurinMap_simdName(JNIEnv* env, jclass type) {
    (void)type;
    return (*env)->NewStringUTF(env, burin_simd_name());
}

JNIEXPORT jlong JNICALL Java_burin_BurinMap_create(JNIEnv* env, jclass type, jfloat voxel_m,
                                                   jfloat truncation_voxels, jfloat min_depth_m,
                                                   jfloat max_depth_m, jlong budget_bytes, jint max_width,
                                                   jint max_height, jint threads, jboolean colour) {
    (void)type;
    burin_config config = burin_config_default();
    const burin_map none = {0, 0};
    uint64_t bytes = 0;
    if (voxel_m != 0) config.voxel_m = voxel_m;
    if (truncation_voxels != 0) config.truncation_voxels = truncation_voxels;
    if (min_depth_m != 0) config.min_depth_m = min_depth_m;
    if (max_depth_m != 0) config.max_depth_m = max_depth_m;
    if (budget_bytes != 0) config.budget_bytes = budget_bytes > 0 ? (uint64_t)budget_bytes : 0;
    if (max_width != 0) config.max_width = (uint32_t)max_width;
    if (max_height != 0) config.max_height = (uint32_t)max_height;
    if (threads != 0) config.threads = (uint32_t)threads;
    config.colour = colour ? 1 : 0;
    if (!ok(env, none, burin_bytes(&config, &bytes))) return 0;

    Holder* h = malloc(sizeof *h);
    void* memory = NULL;
    if (h && posix_memalign(&memory, 4096, (size_t)bytes) != 0) memory = NULL; /* 4096: a chunk is a page */
    if (!memory) {
        free(h);
        throw_new(env, BURIN_INSUFFICIENT_MEMORY, "the process has not the memory that the budget allows");
        return 0;
    }
    h->memory = memory;
    if (!ok(env, none, burin_create(&config, memory, bytes, &h->map))) {
        free(memory);
        free(h);
        return 0;
    }
    return (jlong)(intptr_t)h;
}

JNIEXPORT void JNICALL Java_burin_BurinMap_destroy(JNIEnv* env, jclass type, jlong handle) {
    (void)type;
    Holder* h = holder_of(handle);
    ok(env, h->map, burin_destroy(&h->map));
    free(h->memory);
    free(h);
}

JNIEXPORT void JNICALL Java_burin_BurinMap_integrate(JNIEnv* env, jclass type, jlong handle, jlong t_ns,
                                                     jobject depth, jint depth_stride, jdouble depth_unit_m,
                                                     jint width, jint height, jdoubleArray camera,
                                                     jdoubleArray pose, jobject rgb, jint rgb_stride,
                                                     jint rgb_width, jint rgb_height, jdoubleArray rgb_camera,
                                                     jdoubleArray depth_to_colour, jintArray result) {
    (void)type;
    const burin_map map = holder_of(handle)->map;
    burin_frame f = burin_frame_default();
    burin_frame_result r;
    double c[9], p[7];
    f.t_ns = t_ns;
    f.depth_type = BURIN_DEPTH_U16;
    f.depth_unit_m = depth_unit_m;
    f.depth_stride_bytes = (uint64_t)(depth_stride > 0 ? depth_stride : 0);
    f.depth = direct(env, depth, image_bytes(width, height, depth_stride, 2),
                     "depth: expected a direct buffer of height * stride bytes");
    if (!f.depth) return;
    if (!doubles(env, camera, 9, c, "camera: expected 9 numbers")) return;
    if (!doubles(env, pose, 7, p, "pose: expected tx ty tz qx qy qz qw")) return;
    f.depth_camera = camera_of(width, height, c);
    f.T_world_camera = pose_of(p);
    if (rgb) {
        f.colour_stride_bytes = (uint64_t)(rgb_stride > 0 ? rgb_stride : 0);
        f.colour = direct(env, rgb, image_bytes(rgb_width, rgb_height, rgb_stride, 3),
                          "rgb: expected a direct buffer of height * stride bytes");
        if (!f.colour) return;
        if (!doubles(env, rgb_camera, 9, c, "rgb camera: expected 9 numbers")) return;
        if (!doubles(env, depth_to_colour, 7, p, "depthToColour: expected tx ty tz qx qy qz qw")) return;
        f.colour_camera = camera_of(rgb_width, rgb_height, c);
        f.T_colour_depth = pose_of(p);
    }
    if (!ok(env, map, burin_integrate(map, &f, &r))) return;
    const jint out[6] = {(jint)r.flags,         (jint)r.chunks_fused,   (jint)r.chunks_new,
                         (jint)r.chunks_carved, (jint)r.chunks_dropped, (jint)r.valid_pixels};
    (*env)->SetIntArrayRegion(env, result, 0, 6, out);
}

JNIEXPORT void JNICALL Java_burin_BurinMap_meshSize(JNIEnv* env, jclass type, jlong handle, jlongArray size) {
    (void)type;
    const burin_map map = holder_of(handle)->map;
    const burin_mesh_options options = burin_mesh_options_default();
    uint64_t vertices = 0, triangles = 0;
    if (!ok(env, map, burin_mesh_size(map, &options, &vertices, &triangles))) return;
    const jlong out[2] = {(jlong)vertices, (jlong)triangles};
    (*env)->SetLongArrayRegion(env, size, 0, 2, out);
}

JNIEXPORT void JNICALL Java_burin_BurinMap_mesh(JNIEnv* env, jclass type, jlong handle, jobject positions,
                                                jobject normals, jobject colours, jobject indices) {
    (void)type;
    const burin_map map = holder_of(handle)->map;
    const burin_mesh_options options = burin_mesh_options_default();
    burin_mesh_buffers mesh;
    memset(&mesh, 0, sizeof mesh);
    mesh.positions = direct(env, positions, 0, "positions: expected a direct buffer");
    if (!mesh.positions) return;
    mesh.vertex_capacity = (uint64_t)(*env)->GetDirectBufferCapacity(env, positions) / 12;
    mesh.normals = direct(env, normals, 12 * mesh.vertex_capacity,
                          "normals: expected a direct buffer, as long as positions");
    if (!mesh.normals) return;
    mesh.colours =
        direct(env, colours, 3 * mesh.vertex_capacity, "colours: expected a direct buffer, 3 bytes a vertex");
    if (!mesh.colours) return;
    mesh.triangles = direct(env, indices, 0, "indices: expected a direct buffer");
    if (!mesh.triangles) return;
    mesh.triangle_capacity = (uint64_t)(*env)->GetDirectBufferCapacity(env, indices) / 12;
    ok(env, map, burin_mesh(map, &options, &mesh));
}

JNIEXPORT jlong JNICALL Java_burin_BurinMap_hash(JNIEnv* env, jclass type, jlong handle) {
    (void)type;
    uint64_t hash = 0;
    const burin_map map = holder_of(handle)->map;
    return ok(env, map, burin_hash(map, &hash)) ? (jlong)hash : 0;
}

JNIEXPORT void JNICALL Java_burin_BurinMap_reset(JNIEnv* env, jclass type, jlong handle) {
    (void)type;
    const burin_map map = holder_of(handle)->map;
    ok(env, map, burin_reset(map));
}

/* Java's modified UTF-8 differs from a file system's UTF-8 only beyond U+FFFF and at U+0000. */
static void with_path(JNIEnv* env, burin_map map, jstring path,
                      burin_status (*call)(burin_map, const char*)) {
    const char* text = path ? (*env)->GetStringUTFChars(env, path, NULL) : NULL;
    if (!text) {
        if (!(*env)->ExceptionCheck(env)) throw_new(env, BURIN_INVALID_ARGUMENT, "path: expected a string");
        return;
    }
    const burin_status status = call(map, text);
    (*env)->ReleaseStringUTFChars(env, path, text);
    ok(env, map, status);
}

JNIEXPORT void JNICALL Java_burin_BurinMap_save(JNIEnv* env, jclass type, jlong handle, jstring path) {
    (void)type;
    with_path(env, holder_of(handle)->map, path, burin_save);
}

JNIEXPORT void JNICALL Java_burin_BurinMap_load(JNIEnv* env, jclass type, jlong handle, jstring path) {
    (void)type;
    with_path(env, holder_of(handle)->map, path, burin_load);
}
