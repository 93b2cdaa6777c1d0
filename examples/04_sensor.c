/* SPDX-License-Identifier: MIT
 * A sensor into a scan: frames come from the address given (burin devices lists them), the camera is tracked,
 * the surface grows. Without an argument the sensor is the made-up one, which is always there. Exit 0 when
 * frames came and were taken. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "burin/burin.h"
#include "burin/capture.h"

#define FRAMES 20

static void tell(void* user, burin_log_level level, const char* line) {
    (void)user;
    fprintf(stderr, "%s: %s\n", level == BURIN_LOG_ERROR ? "error" : "sensor", line);
}

int main(int argc, char** argv) {
    const char* address = argc > 1 ? argv[1] : "null:320x240@60";
    burin_source_options options = burin_source_options_default();
    options.log = tell;
    burin_source source;
    if (burin_source_open(address, &options, &source) != BURIN_OK) {
        fprintf(stderr, "%s\n", burin_source_error((burin_source){0, 0}));
        return 1;
    }
    burin_stream_info depth;
    burin_source_stream(source, BURIN_STREAM_DEPTH, &depth);
    if (depth.width == 0) {
        fprintf(stderr, "%s delivers no depth\n", address);
        burin_source_close(&source);
        return 1;
    }
    printf("%s: %ux%u at %.0f a second, %s, intrinsics %s\n", address, (unsigned)depth.width,
           (unsigned)depth.height, depth.fps, depth.format, depth.calibrated ? "of the device" : "nominal");

    /* A map in memory of ours; burin_scan tracks the camera. */
    burin_config config = burin_scan_config_default();
    config.voxel_m = 0.02f;
    config.max_width = depth.width;
    config.max_height = depth.height;
    config.budget_bytes = 64u << 20;
    uint64_t bytes = 0;
    burin_map map = {0, 0};
    void* memory = NULL;
    int taken = 0, tracked = 0;
    if (burin_bytes(&config, &bytes) == BURIN_OK) memory = malloc(bytes + 64);
    if (memory == NULL ||
        burin_create(&config, (char*)memory + (64 - (uintptr_t)memory % 64), bytes, &map) != BURIN_OK) {
        fprintf(stderr, "%s\n", burin_last_error(map));
        goto end;
    }

    if (burin_source_start(source) != BURIN_OK) {
        fprintf(stderr, "%s\n", burin_source_error(source));
        goto end;
    }
    while (taken < FRAMES) {
        burin_captured_frame captured = {0};
        captured.struct_size = sizeof captured;
        const burin_status status = burin_source_next(source, 2000000000, &captured);
        if (status == BURIN_DISCONNECTED)
            continue; /* it says so by itself, and comes back when it is plugged in */
        if (status != BURIN_OK) {
            fprintf(stderr, "%s\n", burin_source_error(source));
            break;
        }
        burin_frame frame;
        burin_scan_result result;
        if (burin_frame_of_capture(source, &captured, &frame) != BURIN_OK ||
            burin_scan(map, &frame, &result) != BURIN_OK) {
            fprintf(stderr, "%s %s\n", burin_source_error(source), burin_last_error(map));
            break;
        }
        ++taken;
        tracked += result.state == BURIN_TRACKING_OK;
    }
    burin_source_statistics statistics = {0};
    statistics.struct_size = sizeof statistics;
    if (burin_source_stats(source, &statistics) == BURIN_OK)
        printf("%d frames taken, %d tracked; depth images lost %" PRIu64 ", dropped %" PRIu64
               "; waited %.1f ms in the median\n",
               taken, tracked, statistics.streams[BURIN_STREAM_DEPTH].lost,
               statistics.streams[BURIN_STREAM_DEPTH].dropped, statistics.wait_p50_ms);
end:
    burin_source_close(&source);
    burin_destroy(&map);
    free(memory);
    return taken == FRAMES && tracked > 0 ? 0 : 1;
}
