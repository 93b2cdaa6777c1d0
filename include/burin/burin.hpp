// SPDX-License-Identifier: MIT
//
// burin.h for C++17: a map that owns itself and its memory, arrays that grow to what a call needs, functions
// where C wants a pointer and a void*. Nothing here throws; every call returns the burin_status of the C
// function of the same name, where units, frames, sizes and errors are described. Works with -fno-exceptions
// and -fno-rtti.
//
//     burin::Map map;
//     if (map.create(config) != BURIN_OK) puts(map.last_error());
//     map.integrate(frame);  ...  burin::Mesh mesh;  map.mesh(mesh);
//
// Ownership   a Map owns its handle and, unless it was handed over, the memory; move-only
// Threads     as in burin.h: one thread at a time in one map
// Errors      what a call in C reports; INSUFFICIENT_MEMORY also when the process has no memory for an array
#ifndef BURIN_BURIN_HPP
#define BURIN_BURIN_HPP

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>

#include "burin/burin.h"

namespace burin {
// Names of its own for the linker: the static library has a namespace burin inside.
inline namespace cpp {

// An array of plain values that does not throw. What it held is gone when it grows.
template <class T>
class Array {
    static_assert(std::is_trivial<T>::value, "plain values only");

  public:
    // False when there is no memory; the array is then as it was.
    [[nodiscard]] bool resize(std::uint64_t size) {
        if (size > capacity_) {
            if (size > SIZE_MAX / sizeof(T)) return false;
            T* grown = new (std::nothrow) T[static_cast<std::size_t>(size)];
            if (!grown) return false;
            data_.reset(grown);
            capacity_ = size;
        }
        size_ = size;
        return true;
    }
    T* data() { return data_.get(); }
    const T* data() const { return data_.get(); }
    std::uint64_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    T* begin() { return data(); }
    T* end() { return data() + size_; }
    const T* begin() const { return data(); }
    const T* end() const { return data() + size_; }
    T& operator[](std::uint64_t i) { return data_[static_cast<std::size_t>(i)]; }
    const T& operator[](std::uint64_t i) const { return data_[static_cast<std::size_t>(i)]; }

  private:
    std::unique_ptr<T[]> data_;
    std::uint64_t size_ = 0, capacity_ = 0;
};

// Layouts as in burin_mesh_buffers. Memory is kept from one call to the next.
struct Mesh {
    Array<float> positions, normals;  // 3 a vertex
    Array<std::uint8_t> colours;      // 3 a vertex
    Array<std::uint32_t> triangles;   // 3 a triangle
    std::uint64_t vertex_count() const { return positions.size() / 3; }
    std::uint64_t triangle_count() const { return triangles.size() / 3; }

    // See burin_mesh_remove_small.
    [[nodiscard]] burin_status remove_small(std::uint64_t min_triangles) {
        Array<std::uint32_t> scratch;
        if (!scratch.resize(2 * vertex_count() + 1)) return BURIN_INSUFFICIENT_MEMORY;
        burin_mesh_buffers b = buffers(vertex_count(), triangle_count());
        b.vertex_count = vertex_count();
        b.triangle_count = triangle_count();
        const burin_status status = burin_mesh_remove_small(&b, min_triangles, scratch.data());
        return status == BURIN_OK ? resize(b.vertex_count, b.triangle_count) : status;
    }

    [[nodiscard]] burin_status resize(std::uint64_t vertices, std::uint64_t faces) {
        const bool room = positions.resize(3 * vertices) && normals.resize(3 * vertices) &&
                          colours.resize(3 * vertices) && triangles.resize(3 * faces);
        return room ? BURIN_OK : BURIN_INSUFFICIENT_MEMORY;
    }
    burin_mesh_buffers buffers(std::uint64_t vertices, std::uint64_t faces) {
        return {vertices, faces, positions.data(), normals.data(), colours.data(), triangles.data(), 0, 0};
    }
};

class Map {
  public:
    Map() = default;
    ~Map() { release(); }
    Map(Map&& other) noexcept : map_(other.map_), memory_(other.memory_) { other.forget(); }
    Map& operator=(Map&& other) noexcept {
        if (this != &other) {
            release();
            map_ = other.map_;
            memory_ = other.memory_;
            other.forget();
        }
        return *this;
    }
    Map(const Map&) = delete;
    Map& operator=(const Map&) = delete;

    // In memory of its own. A map that is there already is destroyed first.
    [[nodiscard]] burin_status create(const burin_config& config) {
        if (const burin_status status = destroy(); status != BURIN_OK) return status;
        std::uint64_t bytes = 0;
        if (const burin_status status = burin_bytes(&config, &bytes); status != BURIN_OK) return status;
        if (bytes > SIZE_MAX) return BURIN_INSUFFICIENT_MEMORY;
        void* memory = ::operator new(static_cast<std::size_t>(bytes), kAlignment, std::nothrow);
        if (!memory) return BURIN_INSUFFICIENT_MEMORY;
        const burin_status status = burin_create(&config, memory, bytes, &map_);
        if (status == BURIN_OK)
            memory_ = memory;
        else
            ::operator delete(memory, kAlignment);
        return status;
    }
    // In the caller's memory, which must outlive the map. See burin_create.
    [[nodiscard]] burin_status create(const burin_config& config, void* memory, std::uint64_t bytes) {
        if (const burin_status status = destroy(); status != BURIN_OK) return status;
        return burin_create(&config, memory, bytes, &map_);
    }
    // STATE when called while the map is in use (from one of its callbacks); the map then stays.
    [[nodiscard]] burin_status destroy() {
        const burin_status status = burin_destroy(&map_);
        if (status != BURIN_OK) return status;
        if (memory_) ::operator delete(memory_, kAlignment);
        memory_ = nullptr;
        return BURIN_OK;
    }
    explicit operator bool() const { return map_.index != 0; }
    burin_map handle() const { return map_; }
    // Also after a create that failed.
    const char* last_error() const { return burin_last_error(map_); }

    [[nodiscard]] burin_status reset() { return burin_reset(map_); }
    [[nodiscard]] burin_status set_hooks(const burin_hooks& hooks) { return burin_set_hooks(map_, &hooks); }
    [[nodiscard]] burin_status integrate(const burin_frame& frame, burin_frame_result* result = nullptr) {
        return burin_integrate(map_, &frame, result);
    }
    [[nodiscard]] burin_status scan(const burin_frame& frame, burin_scan_result* result = nullptr) {
        return burin_scan(map_, &frame, result);
    }
    // The same with work beside it: see burin_scan_beside.
    [[nodiscard]] burin_status scan(const burin_frame& frame, burin_beside& beside,
                                    burin_scan_result* result = nullptr) {
        beside.struct_size = sizeof beside;
        return burin_scan_beside(map_, &frame, &beside, result);
    }
    [[nodiscard]] burin_status stats(burin_statistics& out) const { return burin_stats(map_, &out); }
    [[nodiscard]] burin_status hash(std::uint64_t& out) const { return burin_hash(map_, &out); }

    [[nodiscard]] burin_status mesh(Mesh& out,
                                    const burin_mesh_options& options = burin_mesh_options_default()) {
        std::uint64_t vertices = 0, triangles = 0;
        burin_status status = burin_mesh_size(map_, &options, &vertices, &triangles);
        if (status == BURIN_OK) status = out.resize(vertices, triangles);
        if (status != BURIN_OK) return status;
        burin_mesh_buffers buffers = out.buffers(vertices, triangles);
        return burin_mesh(map_, &options, &buffers);
    }
    [[nodiscard]] burin_status changed_chunks(
        Array<burin_chunk_key>& keys, const burin_change_options& options = burin_change_options_default()) {
        std::uint64_t count = 0;
        burin_status status = burin_changed_chunks(map_, &options, nullptr, 0, &count);
        if (status != BURIN_OK && status != BURIN_INSUFFICIENT_MEMORY) return status;
        if (!keys.resize(count)) return BURIN_INSUFFICIENT_MEMORY;
        return burin_changed_chunks(map_, &options, keys.data(), count, &count);
    }
    [[nodiscard]] burin_status chunk_mesh(burin_chunk_key key, Mesh& out,
                                          const burin_mesh_options& options = burin_mesh_options_default()) {
        constexpr std::uint64_t kVertices = 1944, kTriangles = 2560;  // of burin_chunk_mesh
        if (const burin_status status = out.resize(kVertices, kTriangles); status != BURIN_OK) return status;
        burin_mesh_buffers buffers = out.buffers(kVertices, kTriangles);
        const burin_status status = burin_chunk_mesh(map_, key, &options, &buffers);
        if (status != BURIN_OK) return status;
        return out.resize(buffers.vertex_count, buffers.triangle_count);
    }

    // Several at once, into `out` as it is: see burin_chunk_meshes. `ranges` has room for one a key.
    [[nodiscard]] burin_status chunk_meshes(
        const Array<burin_chunk_key>& keys, burin_mesh_buffers& out, Array<burin_mesh_range>& ranges,
        std::uint64_t& done, const burin_mesh_options& options = burin_mesh_options_default()) {
        if (!ranges.resize(keys.size())) return BURIN_INSUFFICIENT_MEMORY;
        return burin_chunk_meshes(map_, keys.data(), keys.size(), &options, &out, ranges.data(), &done);
    }

    // Images of camera.width * camera.height pixels; each may be null.
    [[nodiscard]] burin_status raycast(const burin_camera& camera, const burin_pose& T_world_camera,
                                       float* depth_m, float* normals = nullptr,
                                       std::uint8_t* rgb = nullptr) const {
        return burin_raycast(map_, &camera, &T_world_camera, depth_m, normals, rgb);
    }
    [[nodiscard]] burin_status sample(const double* points, std::uint64_t count, float* distances,
                                      float* gradients = nullptr) const {
        return burin_sample(map_, points, count, distances, gradients);
    }

    [[nodiscard]] burin_status save(const char* path) const { return burin_save(map_, path); }
    [[nodiscard]] burin_status load(const char* path) { return burin_load(map_, path); }
    // write(const void* data, std::uint64_t bytes) and read(void* data, std::uint64_t bytes) return 0 when
    // all went well. They must not throw.
    template <class Write>
    [[nodiscard]] burin_status save_to(Write&& write) const {
        return burin_save_to(
            map_,
            [](void* user, const void* data, std::uint64_t bytes) -> int {
                return (*static_cast<std::remove_reference_t<Write>*>(user))(data, bytes);
            },
            address(write));
    }
    template <class Read>
    [[nodiscard]] burin_status load_from(Read&& read) {
        return burin_load_from(
            map_,
            [](void* user, void* data, std::uint64_t bytes) -> int {
                return (*static_cast<std::remove_reference_t<Read>*>(user))(data, bytes);
            },
            address(read));
    }

  private:
    static constexpr std::align_val_t kAlignment{4096};  // a chunk is a page

    template <class F>
    static void* address(F& f) {
        return const_cast<void*>(static_cast<const void*>(std::addressof(f)));
    }
    void forget() {
        map_ = {0, 0};
        memory_ = nullptr;
    }
    // A map that is in use cannot be destroyed: its memory then stays with it.
    void release() {
        if (destroy() != BURIN_OK) forget();
    }

    burin_map map_{0, 0};
    void* memory_ = nullptr;
};

}  // namespace cpp
}  // namespace burin
#endif
