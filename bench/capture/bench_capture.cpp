// SPDX-License-Identifier: MIT
// What capture does to a frame of a Kinect, 640 x 480 in packed 11 bits, beside libfreenect on the same
// bytes: bench_capture [--rounds N] [--peer LIBRARY]. The library is freenect_peer.c; without it there is
// nothing beside ours. Lines of "program metric value". Everything takes turns, round after round, on one
// thread; the least processor time of a round counts, which a busy neighbour does not lengthen as it does the
// wall clock.
#include <dlfcn.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <vector>

#include "capture/raw_image.h"
#include "capture/register.h"
#include "scene_helpers.h"
#include "simd/targets.h"

using namespace burin;

namespace {

constexpr int kWidth = 640, kHeight = 480, kPixels = kWidth * kHeight;
// The constants of one Kinect as libfreenect's sources have them for those who have none at hand.
constexpr std::int32_t kNumbers[29] = {
    2048330528, 1964,      56,        -26,       600,       6161, -13,       2825,    684,      5,
    6434,       10062,     130801,    0,         0,         170,  136,       2095986, 890,      763,
    2096378,    134215474, 134217093, 134216989, 134216925, 0,    134216984, 0,       134214659};
constexpr double kConstShift = 200;
constexpr float kEmitter_cm = 7.5f, kColour_cm = 2.3f, kReference_cm = 120, kPixel_cm = 0.1042f;

struct Frame {
    std::vector<std::uint8_t> packed = std::vector<std::uint8_t>(kPixels * 11 / 8);
    std::vector<std::uint16_t> table = std::vector<std::uint16_t>(2048);
    Frame() {
        for (int s = 0; s < 2047; ++s) {
            const double x = ((s - 4 * kConstShift) / 4 - 0.375) * static_cast<double>(kPixel_cm);
            const double z =
                10 * (x * static_cast<double>(kReference_cm) / (static_cast<double>(kEmitter_cm) - x) +
                      static_cast<double>(kReference_cm));
            table[static_cast<std::size_t>(s)] =
                z > 0 && z < 10000 ? static_cast<std::uint16_t>(z) : std::uint16_t{0};
        }
        // Steps on a slanted wall, a tenth of it without depth.
        Rng rng(1);
        for (std::size_t i = 0; i < kPixels; ++i) {
            const int x = static_cast<int>(i) % kWidth, y = static_cast<int>(i) / kWidth;
            const int s = rng.below(10) == 0 ? 2047 : 700 + x / 8 + y / 16 + (x / 80 % 2) * 60 + rng.below(2);
            for (std::size_t b = 0; b < 11; ++b)
                if (s >> (10 - b) & 1)
                    packed[(i * 11 + b) / 8] |= static_cast<std::uint8_t>(128 >> (i * 11 + b) % 8);
        }
    }
};

double cpu_ms() {
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

constexpr int kCalls = 5;

struct Row {
    const char *program, *metric;  // without its unit
    double least_ms = 1e9, cold_ms = 1e9;
    void (*body)(void*);
};

struct Work {
    Frame frame;
    std::vector<std::uint16_t> words = std::vector<std::uint16_t>(kPixels), depth = words, registered = words;
    std::vector<std::uint8_t> rgb = std::vector<std::uint8_t>(3 * kPixels, 90), colours = rgb,
                              mask = std::vector<std::uint8_t>(kPixels);
    ImageRegistration registration;
    std::vector<std::uint16_t> peer_words = words, peer_depth = words, peer_registered = words;
    void (*peer_unpack)(std::uint8_t*, std::uint16_t*, int) = nullptr;
    void (*peer_depth_11)(std::uint8_t*, std::uint16_t*) = nullptr;
    void (*peer_register_11)(std::uint8_t*, std::uint16_t*) = nullptr;

    View<std::uint16_t> view(std::vector<std::uint16_t>& v) { return {v.data(), kWidth, kHeight, kWidth}; }
    void unpack(std::vector<std::uint16_t>& to, bool table) {
        unpack_image(simd::Packing::msb11, {frame.packed.data(), frame.packed.size(), 0},
                     {table ? frame.table.data() : nullptr, 2048}, view(to));
    }
    void forward() { must(registration.depth_to_colour(view(depth), view(registered))); }
    void back() {
        must(registration.colour_to_depth({rgb.data(), kWidth, kHeight, 3 * kWidth, 3}, view(depth),
                                          view(registered), {colours.data(), kWidth, kHeight, 3 * kWidth, 3},
                                          {mask.data(), kWidth, kHeight, kWidth}));
    }
    static void must(const Status& status) {
        if (status) return;
        std::fprintf(stderr, "bench_capture: %s\n", status.text());
        std::exit(1);
    }
};

Work& of(void* work) { return *static_cast<Work*>(work); }

void load_peer(const char* path, Work* work) {
    void* library = dlopen(path, RTLD_LAZY | RTLD_LOCAL);
    if (!library) {
        std::fprintf(stderr, "bench_capture: %s\n", dlerror());
        std::exit(1);
    }
    const auto find = [&](const char* name, auto* function) {
        *reinterpret_cast<void**>(function) = dlsym(library, name);
        if (*function) return;
        std::fprintf(stderr, "bench_capture: %s has no %s\n", path, name);
        std::exit(1);
    };
    void (*configure)(const std::int32_t[29], double, float, float, float, float);
    find("peer_configure", &configure);
    find("peer_unpack_11", &work->peer_unpack);
    find("peer_depth_11", &work->peer_depth_11);
    find("peer_register_11", &work->peer_register_11);
    configure(kNumbers, kConstShift, kEmitter_cm, kColour_cm, kReference_cm, kPixel_cm);
}

}  // namespace

int main(int argc, char** argv) {
    int rounds = 400;
    const char* peer = nullptr;
    for (int i = 1; i < argc; ++i) {
        if (std::strcmp(argv[i], "--rounds") == 0 && i + 1 < argc) {
            rounds = std::atoi(argv[++i]);
        } else if (std::strcmp(argv[i], "--peer") == 0 && i + 1 < argc) {
            peer = argv[++i];
        } else {
            std::fprintf(stderr, "bench_capture: unknown argument %s\n", argv[i]);
            return 2;
        }
    }
    Work work;
    if (peer) load_peer(peer, &work);
    const Camera depth{kWidth, kHeight, 585, 585, 319.5, 239.5},
        colour{kWidth, kHeight, 525, 525, 319.5, 239.5};
    Se3 T_colour_depth;
    T_colour_depth.R = rotation_from_vector({0.004, -0.006, 0.002});
    T_colour_depth.t = {-0.025, 0.0005, 0.001};
    Work::must(work.registration.configure(depth, 0.001, colour, T_colour_depth));

    std::vector<Row> rows = {
        {"burin", "unpack", 1e9, 1e9, [](void* w) { of(w).unpack(of(w).words, false); }},
        {"burin", "unpack_depth", 1e9, 1e9, [](void* w) { of(w).unpack(of(w).depth, true); }},
        {"burin", "register", 1e9, 1e9, [](void* w) { of(w).forward(); }},
        {"burin", "unpack_register", 1e9, 1e9,
         [](void* w) {
             of(w).unpack(of(w).depth, true);
             of(w).forward();
         }},
        {"burin", "colour_to_depth", 1e9, 1e9, [](void* w) { of(w).back(); }},
    };
    if (peer) {
        rows.push_back({"libfreenect", "unpack", 1e9, 1e9, [](void* w) {
                            of(w).peer_unpack(of(w).frame.packed.data(), of(w).peer_words.data(), kPixels);
                        }});
        rows.push_back({"libfreenect", "unpack_depth", 1e9, 1e9, [](void* w) {
                            of(w).peer_depth_11(of(w).frame.packed.data(), of(w).peer_depth.data());
                        }});
        rows.push_back({"libfreenect", "unpack_register", 1e9, 1e9, [](void* w) {
                            of(w).peer_register_11(of(w).frame.packed.data(), of(w).peer_registered.data());
                        }});
    }
    for (int round = 0; round < rounds; ++round)
        for (Row& row : rows)
            for (int call = 0; call < kCalls; ++call) {
                const double start = cpu_ms();
                row.body(&work);
                const double took = cpu_ms() - start;
                row.least_ms = std::min(row.least_ms, took);
                if (call == 0) row.cold_ms = std::min(row.cold_ms, took);
            }
    // A comparison of two that do not compute the same would mean nothing.
    if (peer && work.words != work.peer_words) {
        std::fprintf(stderr, "bench_capture: libfreenect unpacks other pixels\n");
        return 1;
    }
    for (const Row& row : rows) {
        std::printf("%s %s_ms %.4g\n", row.program, row.metric, row.least_ms);
        std::printf("%s %s_cold_ms %.4g\n", row.program, row.metric, row.cold_ms);
    }
    const auto find = [&](const std::string& program, const std::string& metric) -> const Row& {
        return *std::find_if(rows.begin(), rows.end(),
                             [&](const Row& r) { return program == r.program && metric == r.metric; });
    };
    if (peer)
        for (const char* metric : {"unpack", "unpack_depth", "unpack_register"}) {
            const Row &ours = find("burin", metric), &theirs = find("libfreenect", metric);
            std::printf("ratio %s_vs_libfreenect %.4g\n", metric, theirs.least_ms / ours.least_ms);
            std::printf("ratio %s_cold_vs_libfreenect %.4g\n", metric, theirs.cold_ms / ours.cold_ms);
        }
    std::printf("# %s, %d rounds\n", simd::target_name(), rounds);
    return 0;
}
