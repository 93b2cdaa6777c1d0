// SPDX-License-Identifier: MIT
#include "simd/targets.h"

#include <atomic>
#include <cctype>
#include <cstdlib>
#include <cstring>

#if !defined(BURIN_SCALAR_ONLY)
#include "simd/kernel.h"
#endif

namespace burin::simd {

#if defined(BURIN_SCALAR_ONLY)

const char* target_name() { return "scalar"; }
std::vector<std::string> target_names() { return {"scalar"}; }
bool select_target(const std::string& name) { return name.empty() || name == "scalar"; }
bool scalar_selected() { return true; }

#else

namespace {

// "AVX2" -> "avx2"
std::string name_of(long long target) {
    std::string name = hwy::TargetName(target);
    for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return name;
}

bool usable(long long target) { return target != HWY_SCALAR && target != HWY_EMU128; }

struct State {
    // An instance of our own: an application that uses Highway too keeps its choice.
    hwy::ChosenTarget chosen;
    std::atomic<bool> scalar{false};
    std::string name = "scalar";
    State() {
        if (const char* wanted = std::getenv("BURIN_SIMD"); !choose(wanted ? wanted : "")) choose("");
    }
    bool choose(const char* wanted) {
        const bool any = *wanted == 0;
        if (any || std::strcmp(wanted, "scalar") != 0) {
            for (const long long target : hwy::SupportedAndGeneratedTargets()) {
                if (!usable(target) || (!any && name_of(target) != wanted)) continue;
                chosen.Update(target);
                scalar = false;
                name = name_of(target);
                return true;
            }
            if (!any) return false;
        }
        scalar = true;
        name = "scalar";
        return true;
    }
};

State& state() {
    static State the_state;
    return the_state;
}

}  // namespace

const char* target_name() { return state().name.c_str(); }
bool scalar_selected() { return state().scalar.load(std::memory_order_relaxed); }
const hwy::ChosenTarget& chosen_target() { return state().chosen; }
bool select_target(const std::string& name) { return state().choose(name.c_str()); }

std::vector<std::string> target_names() {
    std::vector<std::string> names;
    for (const long long target : hwy::SupportedAndGeneratedTargets()) {
        if (usable(target)) names.push_back(name_of(target));
    }
    names.push_back("scalar");
    return names;
}

#endif

}  // namespace burin::simd
