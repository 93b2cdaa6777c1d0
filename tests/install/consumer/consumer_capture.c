/* SPDX-License-Identifier: MIT
 * A C99 program that takes a frame of the made-up sensor, with the headers and libraries that are installed.
 */
#include <burin/capture.h>
#include <stdio.h>
#include <string.h>

int main(void) {
    burin_source source = {0, 0};
    burin_captured_frame frame;
    burin_status status = burin_source_open("null:64x48@100", NULL, &source);
    memset(&frame, 0, sizeof frame);
    frame.struct_size = sizeof frame;
    if (status == BURIN_OK) status = burin_source_start(source);
    if (status == BURIN_OK) status = burin_source_next(source, 1000000000, &frame);
    if (status != BURIN_OK || !frame.images[BURIN_STREAM_DEPTH].data) {
        fprintf(stderr, "%s: %s\n", burin_strerror(status), burin_source_error(source));
        return 1;
    }
    return burin_source_close(&source) == BURIN_OK ? 0 : 1;
}
