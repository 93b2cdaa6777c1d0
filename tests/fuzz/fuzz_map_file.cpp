// SPDX-License-Identifier: MIT
// Map files: the head from memory, and a whole load. Random bytes never pass the checksums, so the input is
// also mended: where its head looks like one, head, index and voxels get the digests they would need, and the
// load goes on. So does the section of keyframes.
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdio>
#include <string>
#include <vector>

#include "core/hash.h"
#include "fern_helpers.h"
#include "fuzz/fuzz_checks.h"
#include "map/map_file.h"
#include "scene_helpers.h"
#include "track/fern_section.h"

using namespace burin;

namespace {

constexpr std::uint32_t kCapacity = 6, kKeyframes = 3;

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
    TestFerns ferns{FernOptions{kKeyframes}};
    FernSection section{ferns.keyframes};
};

// Whatever came in, asking and adding must be safe, and poses are rigid.
void use(FernKeyframes& keyframes) {
    fuzz::check(keyframes.count() <= kKeyframes && keyframes.ferns() >= 1);
    for (std::uint32_t i = 0; i < keyframes.count(); ++i) {
        const Se3& T = keyframes.keyframe(i).T_world_camera;
        fuzz::check(std::isfinite(T.t.x) && std::isfinite(T.t.y) && std::isfinite(T.t.z));
        fuzz::check(std::fabs(T.R.determinant() - 1) < 1e-5);
    }
    const FernCode code = keyframes.encode(stamp(1));
    FernMatch best[4];
    const int found = keyframes.nearest(code, best, 4);
    for (int i = 0; i < found; ++i)
        fuzz::check(best[i].keyframe < keyframes.count() && best[i].dissimilarity >= 0 &&
                    best[i].dissimilarity <= 1);
    keyframes.add(code, {}, 0, 0);
    keyframes.add(keyframes.encode(stamp(2)), {}, 1, 0);
}

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
    const Status loaded = load_map(volume, head, f.file.path.c_str(), f.scratch, nullptr, &f.section);
    if (!loaded.ok()) {
        fuzz::check(volume.live() == 0 && f.ferns.keyframes.count() == 0);
        return;
    }
    fuzz::check((f.ferns.keyframes.count() == 0) == (head.extra_bytes == 0) || head.extra_bytes == 32);
    use(f.ferns.keyframes);
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

constexpr std::uint32_t kMostExtra = 3 * 4096;

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
    const std::size_t chunks_end = kMapFilePage + index + head.chunks * (head.has_colour ? 4096u : 2048u);
    // Up to so many bytes of keyframes, or as many as their own head says.
    head.extra_bytes %= kMostExtra + 1;
    bytes.resize(std::max(bytes.size(), chunks_end + 32));
    std::uint32_t keyframes = 0;
    std::memcpy(&keyframes, bytes.data() + chunks_end + 24, sizeof keyframes);
    if (head.extra_bytes > 0 && keyframes <= 8)
        head.extra_bytes = static_cast<std::uint32_t>(32 + keyframes * sizeof(FernKeyframe));
    const std::uint64_t extra = extra_section_bytes(head.extra_bytes);
    bytes.resize(chunks_end + extra);
    if (extra > 0) {
        std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(chunks_end + head.extra_bytes), bytes.end(),
                  std::uint8_t{0});
        std::uint64_t h = 0;
        for (std::size_t at = chunks_end; at < bytes.size(); at += kMapFilePage) {
            const bool last = at + kMapFilePage == bytes.size();
            h = hash_bytes(bytes.data() + at, last ? kMapFilePage - 8 : kMapFilePage, h);
        }
        std::memcpy(bytes.data() + bytes.size() - 8, &h, sizeof h);
    }
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
