// The "sinc" filter.
#pragma once

#include "core/interfaces/filter.h"
#include "core/params/plugin.h"

namespace strobe {

/// The Lanczos-windowed sinc along each axis: sinc(x) sinc(x / tau) with x in pixels (pbrt-v4), or, under
/// pbrt-v2's conventions, sinc(x / r) sinc(tau x / r) with the half-width r. It has negative lobes.
Plugin<std::shared_ptr<const Filter>> sincFilterPlugin();

} // namespace strobe
