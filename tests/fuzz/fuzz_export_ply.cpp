// SPDX-License-Identifier: MIT
#include "export/ply.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const Result<TriangleMesh> read = parse_ply({data, size}, fuzz::kName.c_str());
    if (!read) {
        fuzz::check_error(read.status());
        return 0;
    }
    fuzz::check(check_mesh(*read).ok());
    // Nothing that the file did not pay for: a vertex has at least three numbers, a triangle one more corner.
    fuzz::check(3 * read->positions.size() <= size && read->triangles.size() <= size);
    for (const Vec3f& n : read->normals) {
        const float length = norm(n);
        fuzz::check(length == 0 || std::fabs(length - 1) < 1e-3f);
    }
    return 0;
}
