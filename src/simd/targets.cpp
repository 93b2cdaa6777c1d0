// SPDX-License-Identifier: MIT
#include "simd/targets.h"

#include <atomic>
#include <cctype>
#include <cstdint>
#include <cstdlib>

#if !defined(BURIN_SCALAR_ONLY)
#include "simd/kernel.h"
#if HWY_ARCH_ARM_A64 && defined(__linux__)
#include <sys/auxv.h>
#endif
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
std::string lower_case(std::string name) {
    for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return name;
}
std::string name_of(long long target) { return lower_case(hwy::TargetName(target)); }

bool usable(long long target) { return target != HWY_SCALAR && target != HWY_EMU128; }

// The target of that name on any machine, 0 when there is none. A better target is a lower bit.
long long target_named(const std::string& name) {
    for (int bit = 0; bit < 62; ++bit)
        if (name_of(1LL << bit) == name) return 1LL << bit;
    return 0;
}

// The targets that this build holds and this machine runs, best first.
std::vector<std::int64_t> runnable() {
#if HWY_ARCH_ARM_A64 && defined(__linux__)
    // What Highway calls NEON includes the AES instructions. The kernels have none, every aarch64 has the
    // rest, and the Raspberry Pi 3 and 4 have no AES: Highway itself would warn on stderr and leave them to
    // the scalar kernels.
    if ((::getauxval(AT_HWCAP) & HWCAP_AES) == 0) return {HWY_NEON};
#endif
    return hwy::SupportedAndGeneratedTargets();
}

struct State {
    // An instance of our own: an application that uses Highway too keeps its choice.
    hwy::ChosenTarget chosen;
    std::atomic<bool> scalar{false};
    std::string name = "scalar";

    State() {
        const char* limit = std::getenv("BURIN_SIMD");
        const std::string lower = limit ? lower_case(limit) : "";
        // An unknown name (or one of another architecture) limits nothing.
        if (lower == "scalar" || !(choose(target_named(lower), false) || choose(0, false))) choose_scalar();
    }
    // The best usable target, or the best of those not above `wanted` (exactly: only that one).
    bool choose(long long wanted, bool exactly) {
        for (const long long target : runnable()) {
            if (!usable(target) || (exactly ? target != wanted : target < wanted)) continue;
            chosen.Update(target);
            scalar = false;
            name = name_of(target);
            return true;
        }
        return false;
    }
    void choose_scalar() {
        scalar = true;
        name = "scalar";
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

bool select_target(const std::string& name) {
    if (name == "scalar" || (name.empty() && target_names().size() == 1)) {
        state().choose_scalar();
        return true;
    }
    return name.empty() ? state().choose(0, false) : state().choose(target_named(name), true);
}

std::vector<std::string> target_names() {
    std::vector<std::string> names;
    for (const long long target : runnable()) {
        if (usable(target)) names.push_back(name_of(target));
    }
    names.push_back("scalar");
    return names;
}

#endif

}  // namespace burin::simd
