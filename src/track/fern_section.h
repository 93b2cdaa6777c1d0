// SPDX-License-Identifier: MIT
// Keyframes in the map file: a head of 32 bytes, then a FernKeyframe each, in order. See docs/map_file.md.
#pragma once

#include "map/map_extra.h"
#include "track/ferns.h"

namespace burin {

// Loading goes on with the tests of the file, whatever the options say, since codes are comparable only under
// the same tests. More keyframes than there is room for are thinned as add() does it.
class FernSection final : public MapExtra {
  public:
    explicit FernSection(FernKeyframes& keyframes) : keyframes_(keyframes) {}

    std::uint32_t bytes() const override;
    Status save(MapWriter& writer) const override;
    void clear() override { keyframes_.clear(); }
    Status load(MapReader& reader, std::uint32_t bytes, const char* name) override;

  private:
    FernKeyframes& keyframes_;
};

}  // namespace burin
