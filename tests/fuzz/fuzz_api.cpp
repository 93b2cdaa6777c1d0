// SPDX-License-Identifier: MIT
// Random sequences of calls on two small maps: every byte chooses what comes next, with good and bad
// arguments. What must hold: every call returns a status of the header, a call that fails says why in one
// line and leaves the map as it was, and nothing is read or written beside its buffers (the sanitizers
// watch).
#include <burin/burin.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

#include "fuzz/fuzz_checks.h"

namespace {

using burin::fuzz::check;

class Input {
  public:
    Input(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
    bool more() const { return at_ < size_; }
    std::uint8_t byte() { return at_ < size_ ? data_[at_++] : std::uint8_t{0}; }
    bool rarely() { return byte() > 240; }
    std::uint32_t word() {
        std::uint32_t w = 0;
        for (int i = 0; i < 4; ++i) w = w << 8 | byte();
        return w;
    }
    // Mostly in [low, high], now and then anything.
    double number(double low, double high) {
        if (!rarely()) return low + (high - low) * byte() / 255;
        static const double odd[] = {NAN, INFINITY, -INFINITY, 0, -1, 1e300, 1e-300, 1e9};
        return odd[byte() % 8];
    }

  private:
    const std::uint8_t* data_;
    std::size_t size_, at_ = 0;
};

constexpr std::size_t kArena = std::size_t{2} << 20;
constexpr std::uint32_t kSide = 24;  // of images; buffers are exactly as large as what they are said to be

// Heap memory of exactly this size, so that an overrun is seen.
template <class T>
struct Exact {
    explicit Exact(std::size_t n) : data(new T[n]()), size(n) {}
    std::unique_ptr<T[]> data;
    std::size_t size;
};

struct Stream {
    std::vector<std::uint8_t> bytes;
    std::size_t at = 0;
    std::uint32_t fail_after = ~0u;
    static int write(void* user, const void* data, std::uint64_t n) {
        auto& s = *static_cast<Stream*>(user);
        if (s.fail_after-- == 0) return 1;
        s.bytes.insert(s.bytes.end(), static_cast<const std::uint8_t*>(data),
                       static_cast<const std::uint8_t*>(data) + n);
        return 0;
    }
    static int read(void* user, void* data, std::uint64_t n) {
        auto& s = *static_cast<Stream*>(user);
        if (s.fail_after-- == 0 || s.bytes.size() - s.at < n) return 1;
        std::memcpy(data, s.bytes.data() + s.at, n);
        s.at += n;
        return 0;
    }
};

struct Machine {
    explicit Machine(Input& i) : in(i) {
        for (void*& m : memory) check((m = std::aligned_alloc(64, kArena)) != nullptr);
    }
    ~Machine() {
        for (burin_map& m : maps) burin_destroy(&m);
        for (void* m : memory) std::free(m);
    }

    // Looks at the map before and after a call that may fail.
    template <class Call>
    void calls(burin_map map, Call&& call, bool may_empty = false) {
        std::uint64_t before = 0, after = 0;
        const bool there = burin_hash(map, &before) == BURIN_OK;
        const burin_status status = call();
        check(status <= BURIN_OK && status >= BURIN_CANCELLED);
        if (status == BURIN_OK) return;
        check_text(burin_last_error(map));
        if (!there || may_empty) return;
        check(burin_hash(map, &after) == BURIN_OK && before == after);
    }
    static void check_text(const char* text) { check(text[0] != 0 && std::strchr(text, '\n') == nullptr); }

    void create(int which) {
        burin_config c = burin_config_default();
        c.budget_bytes = in.rarely() ? in.word() : kArena - 1000 * in.byte();
        c.voxel_m = static_cast<float>(in.number(0.02, 0.2));
        c.truncation_voxels = static_cast<float>(in.number(2, 8));
        c.max_depth_m = static_cast<float>(in.number(1, 6));
        const std::uint8_t bits = in.byte();
        c.colour = bits & 1, c.bilateral = bits >> 1 & 1, c.edge_removal = bits >> 2 & 1;
        c.angle_weight = bits >> 3 & 1, c.truncation = bits >> 4 & 1, c.weight = bits >> 5 & 1;
        c.truncation_along = bits >> 6 & 1, c.carve = bits >> 7;
        c.drop = in.rarely() ? in.byte() : in.byte() % 3;
        c.max_width = c.max_height = in.rarely() ? in.word() : kSide;
        if (in.rarely()) c.struct_size = in.byte();
        if (in.rarely()) c.version = in.byte();
        if (in.rarely()) c.reserved[in.byte() % 6] = in.byte();
        std::uint64_t bytes = 0;
        const burin_status sized = burin_bytes(&c, &bytes);
        if (sized != BURIN_OK) check_text(burin_last_error(burin_map{0, 0}));
        check(sized != BURIN_OK || bytes <= c.budget_bytes);
        if (maps[which].index != 0 || c.budget_bytes > kArena) return;
        burin_map map{0, 0};
        const burin_status status =
            burin_create(&c, static_cast<char*>(memory[which]) + (in.rarely() ? in.byte() : 0),
                         in.rarely() ? in.word() % kArena : bytes, &map);
        check(sized == BURIN_OK || status == sized);
        if (status == BURIN_OK) maps[which] = map;
    }

    burin_pose pose() {
        burin_pose p = {in.number(-0.5, 0.5), in.number(-0.5, 0.5), in.number(-0.5, 0.5), 0, 0, 0, 1};
        const double a = in.number(-1, 1);
        p.qy = std::sin(a), p.qw = std::cos(a);
        if (in.rarely()) p.qx = in.number(-1, 1);
        return p;
    }
    burin_camera camera() {
        burin_camera c = {};
        c.width = in.rarely() ? in.word() : 1 + in.byte() % kSide;
        c.height = in.rarely() ? in.word() : 1 + in.byte() % kSide;
        c.fx = in.number(5, 60), c.fy = in.number(5, 60);
        c.cx = in.number(-2, 26), c.cy = in.number(-2, 26);
        if (in.rarely()) c.k1 = in.number(-0.3, 0.3), c.p1 = in.number(-0.1, 0.1);
        return c;
    }
    // Bytes of an image as the frame claims it. Nothing beyond a few KiB is made: where the library might
    // accept such a claim, `lies` asks for a null pointer, and otherwise it must refuse before it reads.
    static std::size_t plane(std::uint64_t stride, std::uint64_t rows, std::uint64_t row, bool* lies) {
        const bool refused = stride < row || rows == 0 || row == 0 || rows > 16384;
        const bool small = stride < 4096 && rows <= kSide && row <= 4 * kSide;
        *lies = !refused && !small;
        return !refused && small ? static_cast<std::size_t>(stride * (rows - 1) + row) : 1;
    }

    void integrate(burin_map map) {
        burin_frame f = burin_frame_default();
        f.depth_type = in.rarely() ? in.byte() : in.byte() & 1;
        f.depth_unit_m = in.number(0.0005, 0.002);
        f.depth_camera = camera();
        f.T_world_camera = pose();
        const std::uint64_t sample = f.depth_type == BURIN_DEPTH_U16 ? 2 : 4,
                            row = sample * f.depth_camera.width;
        f.depth_stride_bytes = in.rarely() ? in.word() : row + sample * (in.byte() % 4);
        bool lies = false;
        const std::size_t bytes = plane(f.depth_stride_bytes, f.depth_camera.height, row, &lies);
        Exact<std::uint32_t> depth((bytes + 3) / 4);
        const std::uint32_t base = 1 + in.byte() * 16u, slope = in.byte();
        for (std::size_t i = 0; i < bytes / sample; ++i) {
            const std::uint32_t value = base + slope * static_cast<std::uint32_t>(i % 7);
            const auto raw = static_cast<std::uint16_t>(value);
            const float real = static_cast<float>(value);
            if (sample == 2)
                std::memcpy(reinterpret_cast<char*>(depth.data.get()) + 2 * i, &raw, 2);
            else
                std::memcpy(reinterpret_cast<char*>(depth.data.get()) + 4 * i, &real, 4);
        }
        f.depth = lies || in.rarely() ? nullptr : depth.data.get();

        const std::uint8_t bits = in.byte();
        f.confidence_stride_bytes = in.rarely() ? in.word() : f.depth_camera.width;
        f.min_confidence = in.rarely() ? in.word() : in.byte();
        Exact<std::uint8_t> confidence(
            plane(f.confidence_stride_bytes, f.depth_camera.height, f.depth_camera.width, &lies));
        if (bits & 1 && !lies) f.confidence = confidence.data.get();

        f.colour_format = in.rarely() ? in.byte() : in.byte() % 8;
        f.colour_camera = camera();
        f.T_colour_depth = pose();
        const std::uint64_t width = f.colour_camera.width, height = f.colour_camera.height;
        static const std::uint64_t pixel[8] = {3, 3, 4, 4, 1, 2, 1, 1};
        const std::uint64_t colour_row =
            f.colour_format == BURIN_PIXEL_YUYV ? 4 * ((width + 1) / 2) : pixel[f.colour_format % 8] * width;
        f.colour_stride_bytes = in.rarely() ? in.word() : colour_row + in.byte() % 4;
        f.chroma_stride_bytes = in.rarely() ? in.word() : 2 * ((width + 1) / 2);
        Exact<std::uint8_t> colour(plane(f.colour_stride_bytes, height, colour_row, &lies));
        if (bits & 2 && !lies) f.colour = colour.data.get();
        Exact<std::uint8_t> chroma(
            plane(f.chroma_stride_bytes, (height + 1) / 2, 2 * ((width + 1) / 2), &lies));
        if (!lies) f.chroma = chroma.data.get();
        for (std::size_t i = 0; i < colour.size; ++i) colour.data[i] = static_cast<std::uint8_t>(i * 7);
        if (in.rarely()) f.struct_size = in.byte();
        if (in.rarely()) f.reserved[in.byte() % 8] = in.byte();
        burin_frame_result result;
        calls(map, [&] {
            return burin_integrate(map, in.rarely() ? nullptr : &f, in.rarely() ? nullptr : &result);
        });
    }

    burin_mesh_options options() {
        burin_mesh_options o = burin_mesh_options_default();
        if (in.rarely()) o.min_weight = static_cast<float>(in.number(0, 10));
        if (in.rarely()) o.max_jump_voxels = static_cast<float>(in.number(1, 10));
        if (in.rarely()) o.struct_size = in.byte();
        return o;
    }
    void mesh(burin_map map) {
        const burin_mesh_options o = options();
        std::uint64_t vertices = 0, triangles = 0;
        calls(map, [&] { return burin_mesh_size(map, &o, &vertices, &triangles); });
        check(vertices < 10000000 && triangles < 10000000);
        if (in.rarely()) vertices = in.byte();
        if (in.rarely()) triangles = in.byte();
        Exact<float> positions(3 * vertices), normals(3 * vertices);
        Exact<std::uint8_t> colours(3 * vertices);
        Exact<std::uint32_t> faces(3 * triangles);
        burin_mesh_buffers b = {vertices,
                                triangles,
                                positions.data.get(),
                                normals.data.get(),
                                colours.data.get(),
                                faces.data.get(),
                                0,
                                0};
        burin_status status = BURIN_OK;
        calls(map, [&] { return status = burin_mesh(map, &o, &b); });
        if (status != BURIN_OK) return;
        for (std::uint64_t i = 0; i < 3 * b.triangle_count; ++i) check(faces.data[i] < b.vertex_count);
        for (std::uint64_t i = 0; i < 3 * b.vertex_count; ++i) check(std::isfinite(positions.data[i]));
        Exact<std::uint32_t> scratch(2 * b.vertex_count);
        check(burin_mesh_remove_small(&b, in.byte(), scratch.data.get()) == BURIN_OK);
    }
    void chunks(burin_map map) {
        const std::uint64_t room = in.rarely() ? in.byte() : 4096;
        Exact<burin_chunk_key> keys(room);
        std::uint64_t count = 0;
        burin_status status = BURIN_OK;
        calls(map, [&] { return status = burin_dirty_chunks(map, keys.data.get(), room, &count); });
        Exact<float> positions(3 * 1944);
        Exact<std::uint32_t> faces(3 * 2560);
        burin_mesh_buffers b = {1944, 2560, positions.data.get(), nullptr, nullptr, faces.data.get(), 0, 0};
        if (in.rarely()) b.vertex_capacity = in.byte();
        const burin_mesh_options o = options();
        for (int i = in.byte() % 16; i > 0; --i) {
            burin_chunk_key key = {static_cast<std::int32_t>(in.word()), 0, 0};
            if (status == BURIN_OK && count > 0 && !in.rarely()) key = keys.data[in.byte() % count];
            calls(map, [&] { return burin_chunk_mesh(map, key, &o, &b); });
        }
        if (status != BURIN_OK || b.vertex_capacity != 1944) return;
        Exact<burin_mesh_range> ranges(count);
        std::uint64_t done = 0;
        calls(map, [&] {
            return burin_chunk_meshes(map, keys.data.get(), count, &o, &b, ranges.data.get(), &done);
        });
        check(done <= count);
        for (std::uint64_t i = 0; i < done; ++i)
            check(ranges.data[i].first_vertex + ranges.data[i].vertex_count <= b.vertex_count);
    }
    void raycast(burin_map map) {
        burin_camera c = camera();
        if (c.width > kSide && c.width <= 16384) c.width = 1;
        if (c.height > kSide && c.height <= 16384) c.height = 1;
        const std::size_t pixels = c.width <= kSide && c.height <= kSide ? c.width * c.height : 0;
        Exact<float> depth(pixels), normals(3 * pixels);
        Exact<std::uint8_t> rgb(3 * pixels);
        const burin_pose p = pose();
        calls(map, [&] {
            return burin_raycast(map, &c, in.rarely() ? nullptr : &p, depth.data.get(),
                                 in.rarely() ? nullptr : normals.data.get(),
                                 in.rarely() ? nullptr : rgb.data.get());
        });
    }
    void sample(burin_map map) {
        const std::size_t n = in.byte();
        Exact<double> points(3 * n);
        for (std::size_t i = 0; i < points.size; ++i) points.data[i] = in.number(-2, 2);
        Exact<float> distances(n), gradients(3 * n);
        calls(map, [&] {
            return burin_sample(map, points.data.get(), n, distances.data.get(),
                                in.rarely() ? nullptr : gradients.data.get());
        });
    }
    void save(burin_map map) {
        Stream out;
        if (in.rarely()) out.fail_after = in.byte();
        burin_status status = BURIN_OK;
        calls(map, [&] { return status = burin_save_to(map, Stream::write, &out); });
        if (status == BURIN_OK) saved = std::move(out.bytes);
    }
    void load(burin_map map) {
        Stream s;
        s.bytes = saved;
        if (!s.bytes.empty() && in.rarely()) s.bytes[in.word() % s.bytes.size()] ^= in.byte();
        if (in.rarely()) s.bytes.resize(std::min<std::size_t>(s.bytes.size(), in.word() % 100000));
        if (in.rarely()) s.fail_after = in.byte();
        burin_file_info info;
        burin_probe_from(Stream::read, &s, &info);
        s.at = 0;
        calls(
            map, [&] { return burin_load_from(map, Stream::read, &s); }, true);
    }
    void hooks(burin_map map) {
        burin_hooks h = burin_hooks_default();
        h.user = this;
        const std::uint8_t bits = in.byte();
        patience = in.byte();
        if (bits & 1)
            h.progress = [](void* user, double done) {
                auto& m = *static_cast<Machine*>(user);
                check(done >= 0 && done <= 1);
                return m.patience != 255 && m.patience-- <= 0 ? 1 : 0;
            };
        if (bits & 2)
            h.run = [](void* user, std::uint32_t count, burin_job body, void* context) {
                for (std::uint32_t i = static_cast<Machine*>(user)->skip; i < count; ++i) body(context, i);
                return 0;
            };
        skip = bits >> 2 & 3;
        h.pool_threads = in.rarely() ? in.word() : 1 + in.byte() % 8;
        if (in.rarely()) h.struct_size = in.byte();
        if (in.rarely()) h.reserved[in.byte() % 8] = 1;
        calls(map, [&] { return burin_set_hooks(map, in.rarely() ? nullptr : &h); });
    }

    void step() {
        const std::uint8_t choice = in.byte();
        const int which = choice >> 7;
        // Now and then the handle of a map that was destroyed, or of none.
        const burin_map map = in.rarely() ? burin_map{in.byte() % 4u, in.byte()} : maps[which];
        burin_statistics stats;
        switch (choice % 16) {
            case 0:
                return create(which);
            case 1:
                calls(map, [&] { return burin_reset(map); });
                return;
            case 2:
                if (in.rarely()) burin_destroy(&maps[which]);
                return;
            case 3:
                calls(map, [&] { return burin_stats(map, &stats); });
                return;
            case 4:
            case 5:
                return mesh(map);
            case 6:
                return chunks(map);
            case 7:
            case 8:
                return raycast(map);
            case 9:
                return sample(map);
            case 10:
                return save(map);
            case 11:
                return load(map);
            case 12:
                return hooks(map);
            default:
                return integrate(map);
        }
    }

    Input& in;
    void* memory[2];
    burin_map maps[2] = {{0, 0}, {0, 0}};
    std::vector<std::uint8_t> saved;
    int patience = 0;
    std::uint32_t skip = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Input in(data, size);
    Machine machine(in);
    machine.create(0);
    for (int steps = 0; in.more() && steps < 40; ++steps) machine.step();
    return 0;
}
