// SPDX-License-Identifier: MIT
#include "datasets/synthetic/builder.h"

namespace burin {
namespace {

struct SceneEntry {
    const char* name;
    synthetic::SceneData (*make)(std::uint64_t seed);
};
constexpr SceneEntry kScenes[] = {{"room", synthetic::room_scene},
                                  {"desk", synthetic::desk_scene},
                                  {"corridor", synthetic::corridor_scene},
                                  {"relief", synthetic::relief_scene},
                                  {"figure", synthetic::figure_scene}};

}  // namespace

std::vector<std::string> scene_names() {
    std::vector<std::string> names;
    for (const SceneEntry& entry : kScenes) names.emplace_back(entry.name);
    return names;
}

Result<std::unique_ptr<SyntheticScene>> make_scene(const std::string& name, std::uint64_t seed) {
    for (const SceneEntry& entry : kScenes)
        if (name == entry.name) return SyntheticScene::create(entry.make(seed));
    std::string known;
    for (const SceneEntry& entry : kScenes) known += std::string(known.empty() ? "" : ", ") + entry.name;
    return Status::error(Code::invalid_argument, "scene \"%.60s\": expected one of %s", name.c_str(),
                         known.c_str());
}

}  // namespace burin
