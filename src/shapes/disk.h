// "disk": a disk, ring or sector at a height above the xy plane; its normal is +z.
#pragma once

#include "core/plugin.h"
#include "core/shape.h"

namespace strobe {

/// The table row of the disk.
Plugin<Shape> diskPlugin();

} // namespace strobe
