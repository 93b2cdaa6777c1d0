// SPDX-License-Identifier: MIT
#include "datasets/record3d.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const Result<Record3dMetadata> read = parse_record3d_metadata(fuzz::text_of(data, size), fuzz::kName);
    if (!read) {
        fuzz::check_error(read.status());
        return 0;
    }
    fuzz::check(check_camera(read->colour, "colour").ok());
    for (const Camera& camera : read->colour_of_frame) fuzz::check(check_camera(camera, "colour").ok());
    for (const Se3& T : read->T_world_camera) fuzz::check_rigid(T);
    for (std::size_t i = 1; i < read->t_ns.size(); ++i) fuzz::check(read->t_ns[i - 1] < read->t_ns[i]);
    return 0;
}
