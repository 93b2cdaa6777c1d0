// SPDX-License-Identifier: MIT
#include "datasets/polycam.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const Result<PolycamCamera> read = parse_polycam_camera(fuzz::text_of(data, size), fuzz::kName);
    if (!read) {
        fuzz::check_error(read.status());
        return 0;
    }
    fuzz::check(check_camera(read->colour, "colour").ok());
    fuzz::check_rigid(read->T_world_camera);
    return 0;
}
