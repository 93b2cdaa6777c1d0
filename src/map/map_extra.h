// SPDX-License-Identifier: MIT
// What else a map file keeps behind the chunks, opaque to the map: keyframes. In pages with a digest at the
// end. See docs/map_file.md.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/status.h"

namespace burin {

inline constexpr std::size_t kMapFilePage = 4096;

// Where the bytes of a map go, in order, in pieces of 2 or 4 KiB; and where they come from.
class MapWriter {
  public:
    virtual Status write(const void* data, std::size_t bytes) = 0;

  protected:
    ~MapWriter() = default;
};
class MapReader {
  public:
    virtual Status read(void* to, std::size_t bytes) = 0;

  protected:
    ~MapReader() = default;
};

// Implemented above the map by whoever wants to be saved with it. save() and load() get a writer and a reader
// that take pieces of any size.
class MapExtra {
  public:
    virtual std::uint32_t bytes() const = 0;  // that save() writes; 0: nothing, then the file has no section
    virtual Status save(MapWriter& writer) const = 0;
    virtual void clear() = 0;  // the map was emptied, or could not be loaded
    // Replaces the content by the file's, all `bytes` of it; `name` is for messages. Whether they are those
    // that were written is known only at the end, so that any bytes must be safe; clear() follows if not.
    virtual Status load(MapReader& reader, std::uint32_t bytes, const char* name) = 0;

  protected:
    ~MapExtra() = default;
};

// The bytes that `bytes` of content take in the file.
std::uint64_t extra_section_bytes(std::uint32_t bytes);

Status save_extra(const MapExtra& extra, MapWriter& writer, const char* name);
// Null: reads past it, and checks it all the same.
Status load_extra(MapExtra* extra, std::uint32_t bytes, MapReader& reader, const char* name);

}  // namespace burin
