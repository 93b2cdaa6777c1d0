// SPDX-License-Identifier: MIT
// Map files: the head from memory, and a whole load. Random bytes never pass the checksums, so the input is
// also mended: where its head looks like one, head, index and voxels get the digests they would need, and the
// load goes on.
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdio>
#include <string>
#include <vector>

#include "core/hash.h"
#include "fuzz/fuzz_checks.h"
#include "map/map_file.h"
#include "scene_helpers.h"

using namespace burin;

namespace {

constexpr std::uint32_t kCapacity = 6;

// A file without a disk.
struct MemoryFile {
    MemoryFile() : fd(::memfd_create("input", 0)), path("/proc/self/fd/" + std::to_string(fd)) {}
    int fd;
    std::string path;
    void put(const std::vector<std::uint8_t>& bytes) const {
        fuzz::check(::ftruncate(fd, 0) == 0);
        fuzz::check(::pwrite(fd, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size()));
    }
};

struct Fixture {
    MemoryFile file;
    TestVolume with{{kCapacity, true, 0.01f, 0.04f}}, without{{kCapacity, false, 0.01f, 0.04f}};
    std::uint32_t scratch[kCapacity];
};

void load(Fixture& f, const std::vector<std::uint8_t>& bytes) {
    f.file.put(bytes);
    MapFileHead head, again;
    const Status parsed =
        parse_map_head(bytes.data(), bytes.size(), bytes.size(), fuzz::kName.c_str(), &head);
    if (!parsed.ok()) fuzz::check_error(parsed);
    const Status read = read_map_head(f.file.path.c_str(), &again);
    fuzz::check(parsed.code() == read.code());
    if (!parsed.ok() || head.chunks > kCapacity) return;  // the caller checks the room
    Volume& volume = (head.has_colour ? f.with : f.without).volume;
    const Status loaded = load_map(volume, head, f.file.path.c_str(), f.scratch);
    if (!loaded.ok()) {
        fuzz::check(volume.live() == 0);
        return;
    }
    fuzz::check(volume.live() == head.chunks && volume.hash(f.scratch) == head.map_hash);
    for (std::uint32_t slot = 0; slot < volume.live(); ++slot) {
        fuzz::check(chunk_in_range(unpack_key(volume.key(slot))));
        fuzz::check(volume.find(volume.key(slot)) == slot);
    }
    // Whatever the voxels hold, meshing and sampling them must be safe: -32768 and weights out of range
    // included.
    std::vector<float> positions(3 * kMaxChunkVertices);
    std::vector<std::uint32_t> triangles(3 * kMaxChunkTriangles);
    for (std::uint32_t slot = 0; slot < volume.live(); ++slot) {
        const MeshCounts counts =
            mesh_chunk(volume, Neighbourhood(volume, unpack_key(volume.key(slot))), {0.5f, 1e9f},
                       {positions.data(), nullptr, nullptr, triangles.data()});
        fuzz::check(counts.vertices <= kMaxChunkVertices && counts.triangles <= kMaxChunkTriangles);
    }
}

// The same bytes with the digests, the count and the length that would be right for them.
std::vector<std::uint8_t> mended(const std::uint8_t* data, std::size_t size) {
    MapFileHead head;
    std::vector<std::uint8_t> bytes(data, data + size);
    std::memcpy(&head, bytes.data(), sizeof head);
    std::memcpy(head.magic, "BURINMAP", 8);
    head.version = kMapFileVersion;
    head.byte_order = 0x01020304;
    head.has_colour &= 1;
    head.chunks %= kCapacity + 1;
    const std::size_t index = head.chunks == 0 ? 0 : kMapFilePage;
    bytes.resize(kMapFilePage + index + head.chunks * (head.has_colour ? 4096u : 2048u));
    const std::uint8_t* entries = bytes.data() + kMapFilePage;
    head.index_hash = 0;
    for (std::uint32_t i = 0; i < head.chunks; ++i)
        head.index_hash = hash_bytes(entries + 16 * i, 16, head.index_hash);
    std::uint64_t h = mix64(head.chunks);
    for (std::uint32_t i = 0; i < head.chunks; ++i) {
        ChunkKey key;
        std::memcpy(&key, entries + 16 * i, sizeof key);
        std::uint64_t chunk = hash_bytes(entries + index + 2048 * i, 2048, key);
        if (head.has_colour) chunk = hash_bytes(entries + index + 2048 * (head.chunks + i), 2048, chunk);
        h = mix64(h ^ chunk) + i;
    }
    head.map_hash = h;
    head.head_hash = hash_bytes(&head, offsetof(MapFileHead, head_hash));
    std::memcpy(bytes.data(), &head, sizeof head);
    return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static Fixture fixture;
    load(fixture, std::vector<std::uint8_t>(data, data + size));
    if (size >= sizeof(MapFileHead)) load(fixture, mended(data, size));
    return 0;
}
