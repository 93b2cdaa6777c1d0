// SPDX-License-Identifier: MIT
// What every Highway kernel file includes. A kernel file looks like this:
//
//   #include "simd/kernel_targets.h"        (which targets there are)
//   #undef HWY_TARGET_INCLUDE
//   #define HWY_TARGET_INCLUDE "simd/NAME_highway.cpp"
//   #include <hwy/foreach_target.h>         (includes this very file once a target)
//   #include <hwy/highway.h>                (here, not in a header: its contents change with the target)
//   #include "simd/kernel.h"
//   HWY_BEFORE_NAMESPACE(); namespace burin::simd::HWY_NAMESPACE { ... Kernel ... } HWY_AFTER_NAMESPACE();
//   #if HWY_ONCE
//   HWY_EXPORT(Kernel);  ...  return BURIN_DISPATCH(Kernel)(arguments);
//   #endif
#pragma once

#include "simd/kernel_targets.h"

#include <hwy/highway.h>
#include <hwy/targets.h>

#include "simd/targets.h"

namespace burin::simd {

const hwy::ChosenTarget& chosen_target();

}  // namespace burin::simd

#if (HWY_TARGETS & (HWY_TARGETS - 1)) == 0
#define BURIN_DISPATCH(FUNCTION) HWY_STATIC_DISPATCH(FUNCTION)
#else
#define BURIN_DISPATCH(FUNCTION) (*(HWY_DISPATCH_TABLE(FUNCTION)[::burin::simd::chosen_target().GetIndex()]))
#endif
